#include "apps/options/picture/light_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "apps/options/picture/colour_options.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/light/deep_shadow.h"

namespace nephele::apps {
namespace {

using Numbers = std::vector<double>;

// "key=1,2,3" as "key" and "1,2,3"; the name is empty if there is none.
std::pair<std::string, std::string> named(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) return {"", text};
  return {text.substr(0, equals), text.substr(equals + 1)};
}

std::string nextName(const std::string& given, const std::string& kind, std::size_t before) {
  if (!given.empty()) return given;
  return before == 0 ? kind : fmt::format("{}{}", kind, before + 1);
}

// One intensity, or three.
std::optional<Vec3f> colourFrom(const Numbers& numbers, std::size_t first) {
  for (std::size_t i = first; i < numbers.size(); ++i)
    if (numbers[i] < 0) return std::nullopt;
  if (numbers.size() == first + 1) return Vec3f{1, 1, 1} * float(numbers[first]);
  if (numbers.size() != first + 3) return std::nullopt;
  return Vec3f{float(numbers[first]), float(numbers[first + 1]), float(numbers[first + 2])};
}

Vec3f vectorFrom(const Numbers& numbers, std::size_t first) {
  return {float(numbers[first]), float(numbers[first + 1]), float(numbers[first + 2])};
}

// An option that may be given again; `take` returns false for what is not of the `form`.
CLI::Option* addRepeated(CLI::App& app, const std::string& option, const std::string& type,
                         const std::string& form, const std::string& description,
                         const std::function<bool(const std::string& name, const std::string& text)>& take) {
  return app
      .add_option_function<std::vector<std::string>>(
          option,
          [option, form, take](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              const auto [name, rest] = named(text);
              if (!take(name, rest)) refuseValue(option, text, form);
            }
          },
          description)
      ->type_name(type)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

DistantLight sunOf(const std::string& name, const Numbers& numbers, const Vec3f& irradiance) {
  return {name, directionTowards(float(numbers[0]), float(numbers[1])), irradiance};
}

// Irradiance that makes a cloud nearly white in a preview without exposure.
constexpr float kSunIntensity = 3.6f;

DistantLight defaultSun() {
  return sunOf("sun", {90, 38}, Vec3f{1, 1, 1} * kSunIntensity);
}

void addSuns(CLI::App& app, LightOptions& options) {
  const std::string form = "none, or [NAME=]AZIMUTH,ELEVATION[,INTENSITY or ,R,G,B], intensities at least 0";
  addRepeated(
      app, "--sun", "[NAME=]AZ,EL[,INTENSITY|,R,G,B]", form,
      "Where sunlight comes from, in degrees as for --view, and its irradiance (else that of --sky clear, "
      "or 3.6); may be given again. none: no sun.",
      [&options, form](const std::string& name, const std::string& text) {
        if (text == "none") return options.noSun = true;
        Numbers numbers = parseNumbers("--sun", text, form);
        auto& suns = options.lights.suns;
        if (numbers.size() == 2) {
          options.sunsOfTheSky.push_back(suns.size());
          numbers.push_back(double(kSunIntensity));
        }
        const auto colour = colourFrom(numbers, 2);
        if (!colour) return false;
        suns.push_back(sunOf(nextName(name, "sun", suns.size()), numbers, *colour));
        return true;
      })
      ->default_str("90,38");
}

std::size_t countOf(const Lights& lights, bool spots) {
  return std::size_t(std::count_if(lights.locals.begin(), lights.locals.end(),
                                   [&](const LocalLight& light) { return light.cone.has_value() == spots; }));
}

void addLocals(CLI::App& app, LightOptions& options) {
  const std::string point = "[NAME=]X,Y,Z,INTENSITY or [NAME=]X,Y,Z,R,G,B, intensities at least 0";
  addRepeated(app, "--point", "[NAME=]X,Y,Z,INTENSITY|R,G,B", point,
              "A light at a place, in world units, with its irradiance at distance 1; may be given again.",
              [&options, point](const std::string& name, const std::string& text) {
                const Numbers numbers = parseNumbers("--point", text, point);
                const auto colour = colourFrom(numbers, 3);
                if (!colour) return false;
                LocalLight& light = options.lights.locals.emplace_back();
                light.name = nextName(name, "point", countOf(options.lights, false) - 1);
                light.position = vectorFrom(numbers, 0);
                light.intensity = *colour;
                return true;
              });
  const std::string spot =
      "[NAME=]X,Y,Z,TO_X,TO_Y,TO_Z,ANGLE,PENUMBRA,INTENSITY (or R,G,B): ANGLE within (0, 90] degrees from "
      "the "
      "axis, PENUMBRA within [0, ANGLE]";
  addRepeated(app, "--spot", "[NAME=]X,Y,Z,TOX,TOY,TOZ,ANGLE,PENUMBRA,INTENSITY|R,G,B", spot,
              "The same in a cone around the way to another place: half its opening in degrees, and over how "
              "many of these it fades; may be given again.",
              [&options, spot](const std::string& name, const std::string& text) {
                const Numbers numbers = parseNumbers("--spot", text, spot);
                const auto colour = colourFrom(numbers, 8);
                if (!colour || !(numbers[6] > 0 && numbers[6] <= 90) ||
                    !(numbers[7] >= 0 && numbers[7] <= numbers[6]))
                  return false;
                LocalLight light;
                light.position = vectorFrom(numbers, 0);
                light.cone = LocalLight::Cone{vectorFrom(numbers, 3) - light.position, float(numbers[6]),
                                              float(numbers[7])};
                light.name = nextName(name, "spot", countOf(options.lights, true));
                light.intensity = *colour;
                options.lights.locals.push_back(light);
                return true;
              });
}

void addSaid(CLI::App& app, LightOptions& options) {
  addRepeated(app, "--light-decay", "[NAME=]quadratic|linear|none[,START]",
              "[NAME=]quadratic, linear or none, and a length of at least 0 where it starts, in world units "
              "or percent "
              "of the longest side",
              "How points and spots get weaker with distance, and up to where they do not (a length); of one "
              "light or of "
              "all.",
              [&options](const std::string& name, const std::string& text) {
                const std::size_t comma = text.find(',');
                const std::string kind = text.substr(0, comma);
                LightOptions::DecayFrom said;
                if (kind == "linear")
                  said.decay = Decay::linear;
                else if (kind == "none")
                  said.decay = Decay::none;
                else if (kind != "quadratic")
                  return false;
                if (comma != std::string::npos) {
                  const auto start = parseLength(std::string_view(text).substr(comma + 1));
                  if (!start || start->value < 0) return false;
                  said.start = *start;
                }
                options.decays.emplace_back(name, said);
                return true;
              })
      ->default_str("quadratic");
  const std::string form = "[NAME=]R,G,B, each within [0, 100]";
  addRepeated(
      app, "--shadow-multiplier", "[NAME=]R,G,B", form,
      "Multiplies the extinction on the way from the light, per colour: 1,0.3,0.05 lets green and blue "
      "through where red is in shadow; of one light or of all.",
      [&options, form](const std::string& name, const std::string& text) {
        const Numbers numbers = parseNumbers("--shadow-multiplier", text, form);
        if (numbers.size() != 3 || !std::ranges::all_of(numbers, [](double x) { return x >= 0 && x <= 100; }))
          return false;
        options.shadows.emplace_back(name, vectorFrom(numbers, 0));
        return true;
      })
      ->default_str("1,1,1");
}

CLI::Option* addFiles(CLI::App& app, const std::string& option, LightOptions::Said<std::string>& said,
                      const std::string& description) {
  return addRepeated(app, option, "[NAME=]FILE.exr", "[NAME=]FILE.exr", description,
                     [&said](const std::string& name, const std::string& text) {
                       said.emplace_back(name, text);
                       return text.ends_with(".exr");
                     });
}

void addDeepShadows(CLI::App& app, LightOptions& options) {
  addChoice(
      app, "--shadows", options.deepShadows, {{"volume", false}, {"deep", true}},
      "Where shadows come from: sweeps through the volume, or deep shadow maps, whose light must see the "
      "volume within 75 degrees of its middle.");
  addChoice(app, "--shadow-detail", options.lights.shadowDetail, {{"1", 1}, {"2", 2}, {"4", 4}},
            "Points per voxel, along each axis, where sweeps keep the shadow. 2 is for volumes whose voxels "
            "are nearly "
            "opaque: eight times the memory.");
  addNumber(
      app, "--shadow-tolerance", 1e-6, 0.5, [&options](double x) { options.deepTolerance = float(x); },
      "Largest error of the transmittance in deep shadow maps.")
      ->default_str(fmt::format("{:g}", options.deepTolerance));
  addFiles(app, "--read-deep-shadow", options.readShadows,
           "Takes the shadow in a light from a deep image made from its place; of one light or of all.");
}

bool isFile(const std::string& text) {
  std::string end = text.substr(std::min(text.rfind('.'), text.size()));
  std::ranges::transform(end, end.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return end == ".exr" || end == ".hdr" || end == ".png";
}

// "clear" or "clear:TURBIDITY".
std::optional<float> turbidityFrom(const std::string& text, const std::string& form) {
  const std::string kind = text.substr(0, text.find(':'));
  if (kind != "clear") return std::nullopt;
  if (kind.size() == text.size()) return ClearSky::Options{}.turbidity;
  const Numbers numbers = parseNumbers("--sky", text.substr(kind.size() + 1), form);
  if (numbers.size() != 1 || !(numbers[0] >= 1 && numbers[0] <= 10)) refuseValue("--sky", text, form);
  return float(numbers[0]);
}

void addSky(CLI::App& app, LightOptions& options) {
  app.add_option_function<std::string>(
         "--sky",
         [&options](const std::string& text) {
           options.skyGiven = true;
           options.turbidity.reset();
           if (isFile(text)) {
             options.skyFile = text;
             return;
           }
           const std::string form =
               "R,G,B, each at least 0, a map (.exr, .hdr, .png), or clear[:TURBIDITY], 1 to 10";
           if ((options.turbidity = turbidityFrom(text, form))) {
             options.skyFile.clear();
             return;
           }
           const auto colour = colourFrom(parseNumbers("--sky", text, form), 0);
           if (!colour || std::ranges::count(text, ',') != 2) refuseValue("--sky", text, form);
           options.skyFile.clear();
           options.lights.sky = *colour;
         },
         "clear: the sky that belongs to the first sun, from noon to dusk, and suns without an irradiance "
         "get "
         "theirs; TURBIDITY is its haze, 1 (none) to 10, 2 if not given. Or a radiance, the same in all "
         "directions, or a map of all directions.")
      ->type_name("clear[:TURBIDITY]|R,G,B|FILE")
      ->default_str("clear");
  app.add_option_function<std::string>(
         "--ground-albedo",
         [&options](const std::string& text) {
           const std::string form = "A, or R,G,B, each within [0, 1]";
           const Numbers numbers = parseNumbers("--ground-albedo", text, form);
           const auto colour = colourFrom(numbers, 0);
           if (!colour || std::ranges::any_of(numbers, [](double x) { return x > 1; }))
             refuseValue("--ground-albedo", text, form);
           options.groundAlbedo = *colour;
         },
         "What the ground under --sky clear reflects; it lights clouds from below.")
      ->type_name("A|R,G,B")
      ->default_str(fmt::format("{:g}", options.groundAlbedo.x));
  addNumber(
      app, "--sky-rotation", -36000, 36000, [&options](double x) { options.sky.rotationDegrees = float(x); },
      "Turns the map about the vertical axis; azimuths grow by as much.")
      ->type_name("DEGREES")
      ->default_str("0");
  addNumber(
      app, "--sky-intensity", 0, 1e6, [&options](double x) { options.sky.intensity = float(x); },
      "Multiplies the radiance of the sky.")
      ->default_str("1");
  addColourEncoding(app, "--sky-encoding", options.sky.encoding,
                    "How the numbers of the map stand for light; auto: as the file says.");
}

void requireLight(const std::string& option, const std::string& name, bool known, const Lights& lights) {
  if (known || name.empty()) return;
  std::string there;
  for (const std::string& one : lights.names())
    if (one != "sky") there += (there.empty() ? "" : ", ") + one;
  throw Error(fmt::format("{}: no light is called '{}'; there are: {}", option, name,
                          there.empty() ? "none" : there));
}

// Calls `act` with the light called `name`, or with all if that is empty.
template <class SomeLights, class Act>
void forLights(const std::string& option, const std::string& name, SomeLights& lights, const Act& act) {
  bool known = false;
  const auto visit = [&](auto& light) {
    if (!name.empty() && light.name != name) return;
    act(light);
    known = true;
  };
  for (auto& sun : lights.suns) visit(sun);
  for (auto& light : lights.locals) visit(light);
  requireLight(option, name, known, lights);
}

}  // namespace

void addLightOptions(CLI::App& app, LightOptions& options) {
  addSuns(app, options);
  addLocals(app, options);
  addSaid(app, options);
  addDeepShadows(app, options);
  addSky(app, options);
}

void addShadowOutput(CLI::App& app, LightOptions& options) {
  markOutput(addFiles(app, "--write-deep-shadow", options.writtenShadows,
                      "Writes the deep shadow map of a light; without a name, of the only one."));
}

void LightOptions::suggestSky(const Vec3f& radiance) {
  if (skyGiven) return;
  turbidity.reset();
  lights.sky = radiance;
}

void LightOptions::suggestSun(double azimuth, double elevation, double irradiance) {
  if (noSun || !lights.suns.empty() || !lights.locals.empty()) return;
  if (irradiance == 0)
    noSun = true;
  else
    lights.suns.push_back(sunOf("sun", {azimuth, elevation}, Vec3f{1, 1, 1} * float(irradiance)));
}

bool LightOptions::readsCodes() const {
  return lights.locals.empty() && lights.shadowDetail == 1 && !deepShadows && readShadows.empty() &&
         writtenShadows.empty();
}

// The sky of the first sun, and the light that it leaves of those suns that have none of their own.
void LightOptions::setClearSky(const std::vector<std::size_t>& ofTheSky, Lights& result) const {
  // Enough for a backdrop that is interpolated.
  constexpr int kRows = 96;
  const auto skyOf = [&](const Vec3f& sun) {
    ClearSky::Options options;
    options.sun = sun;
    options.turbidity = *turbidity;
    options.groundAlbedo = groundAlbedo;
    return ClearSky(options);
  };
  result.clear = std::make_shared<const ClearSky>(
      skyOf(result.suns.empty() ? defaultSun().direction : result.suns.front().direction));
  for (const std::size_t i : ofTheSky) {
    DistantLight& sun = result.suns[i];
    sun.irradiance = i == 0 ? result.clear->sunlight() : skyOf(sun.direction).sunlight();
  }
  result.map = std::make_shared<const Environment>(result.clear->map(kRows, sky.intensity));
  result.sky = {};
}

Lights LightOptions::resolved(double longestSide, double mostBytes) const {
  Lights result = lights;
  std::vector<std::size_t> ofTheSky = sunsOfTheSky;
  if (noSun) {
    result.suns.clear();
    ofTheSky.clear();
  }
  if (!noSun && result.suns.empty() && result.locals.empty() && skyFile.empty()) {
    result.suns.push_back(defaultSun());
    ofTheSky.push_back(0);
  }
  for (const auto& [name, said] : decays) {
    bool known = false;
    for (LocalLight& light : result.locals)
      if (name.empty() || light.name == name) {
        light.decay = said.decay;
        light.decayStart = float(said.start.worldUnits(longestSide));
        known = true;
      }
    for (const DistantLight& sun : result.suns)
      if (!known && sun.name == name)
        throw Error(fmt::format("--light-decay: '{}' is a sun, and suns have no decay", name));
    requireLight("--light-decay", name, known, result);
  }
  for (const auto& [name, said] : shadows)
    forLights("--shadow-multiplier", name, result, [&, value = said](auto& light) { light.shadow = value; });
  if (deepShadows) result.deepTolerance = deepTolerance;
  for (const auto& [name, file] : readShadows) {
    const auto map = std::make_shared<const DeepShadowMap>(DeepShadowMap::read(file));
    forLights("--read-deep-shadow", name, result, [&, path = file](auto& light) {
      map->requireMadeFor(light, path);
      light.deepShadow = map;
    });
  }
  if (turbidity && sky.rotationDegrees != 0)
    throw CLI::ValidationError(
        "--sky-rotation", "turns a map (--sky FILE); a clear sky belongs to its sun, and turns with --sun");
  result.sky *= sky.intensity;
  if (turbidity) setClearSky(ofTheSky, result);
  if (!skyFile.empty()) {
    result.map = std::make_shared<const Environment>(Environment::read(skyFile, sky, mostBytes));
    result.sky = {};
  }
  result.check();
  return result;
}

void LightOptions::writeShadows(const RenderVolume& volume, const Lights& all, const Medium& medium,
                                const Run& run) const {
  const Vec3f& share = medium.extinctionColour;
  const float extinction = medium.extinction * std::max({share.x, share.y, share.z});
  for (const auto& [name, file] : writtenShadows) {
    if (name.empty() && all.suns.size() + all.locals.size() != 1)
      throw Error("--write-deep-shadow: expected NAME=FILE.exr, since there is not one light");
    run.begin("deep shadow");
    forLights("--write-deep-shadow", name, all, [&, path = file](const auto& light) {
      DeepShadowMap(volume, light, extinction, {deepTolerance}, run).write(path, run.metadata());
    });
  }
}

}  // namespace nephele::apps
