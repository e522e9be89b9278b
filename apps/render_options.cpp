#include "apps/render_options.h"

#include <fmt/format.h>

#include <limits>

#include "levelset/vdb_io.h"

namespace nephele::apps {
namespace {

constexpr double kAny = std::numeric_limits<double>::max();

[[noreturn]] void refuse(const std::string& option, const std::string& text, const std::string& allowed) {
  throw CLI::ValidationError(option, fmt::format("got '{}', allowed: {}", text, allowed));
}

// An option that is a list of numbers: `count` of them (or one less if `lastMayMiss`), each within [low,
// high].
CLI::Option* addNumbers(CLI::App& app, const std::string& name, const std::string& form, std::size_t count,
                        double low, double high, const std::function<void(const Vec3f&)>& set,
                        const std::string& description) {
  const std::string allowed = low > -kAny ? fmt::format("{}, each {} to {:g}", form, low, high) : form;
  const std::string wanted = high < kAny   ? allowed
                             : low > -kAny ? fmt::format("{}, each at least {:g}", form, low)
                                           : form;
  return app
      .add_option_function<std::string>(
          name,
          [=](const std::string& text) {
            const std::vector<double> numbers = parseNumbers(name, text, wanted);
            bool fits = numbers.size() == count;
            for (const double number : numbers) fits = fits && number >= low && number <= high;
            if (!fits) refuse(name, text, wanted);
            set({float(numbers[0]), float(numbers[1]), count > 2 ? float(numbers[2]) : 0.0f});
          },
          description)
      ->type_name(form);
}

DistantLight sunFrom(const std::vector<double>& numbers, std::size_t index) {
  // Irradiance that makes a cloud nearly white in a preview without exposure.
  const float intensity = numbers.size() > 2 ? float(numbers[2]) : 6.5f;
  return {index == 0 ? "sun" : fmt::format("sun{}", index + 1),
          directionTowards(float(numbers[0]), float(numbers[1])), Vec3f{1, 1, 1} * intensity};
}

void addCamera(CLI::App& app, PictureOptions& options) {
  app.add_option_function<std::string>(
         "--size",
         [&options](const std::string& text) {
           int width = 0, height = 0, used = 0;
           if (std::sscanf(text.c_str(), "%dx%d%n", &width, &height, &used) != 2 ||
               std::size_t(used) != text.size() || width < 1 || height < 1 || width > 65536 || height > 65536)
             refuse("--size", text, "WxH, each 1 to 65536");
           options.frame.width = width;
           options.frame.height = height;
         },
         "Pixels across and down.")
      ->type_name("WxH")
      ->default_str(fmt::format("{}x{}", options.frame.width, options.frame.height));
  CLI::Option* view =
      addNumbers(
          app, "--view", "AZIMUTH,ELEVATION", 2, -360, 360, [&options](const Vec3f& v) { options.view = v; },
          "Where the camera stands, in degrees, at the distance that frames the volume: azimuth from the "
          "front (+z) "
          "towards +x, elevation from the horizon.")
          ->default_str(fmt::format("{:g},{:g}", options.view.x, options.view.y));
  CLI::Option* position =
      addNumbers(
          app, "--camera-position", "X,Y,Z", 3, -kAny, kAny,
          [&options](const Vec3f& v) { options.position = v; }, "Where the camera stands.")
          ->excludes(view);
  addNumbers(
      app, "--look-at", "X,Y,Z", 3, -kAny, kAny, [&options](const Vec3f& v) { options.lookAt = v; },
      "What it looks at; default: the middle of the volume.")
      ->needs(position);
  addVec3(app, "--up", options.up, "What is up in the picture.")->needs(position);
  app.add_option_function<double>(
         "--fov",
         [&options](double degrees) {
           if (!(degrees >= 0.1 && degrees <= 170))
             refuse("--fov", fmt::format("{:g}", degrees), "0.1 to 170 degrees");
           options.frame.fovDegrees = float(degrees);
         },
         "Horizontal angle of view in degrees.")
      ->type_name("DEGREES")
      ->default_str(fmt::format("{:g}", options.frame.fovDegrees));
}

void addLights(CLI::App& app, PictureOptions& options) {
  app.add_option_function<std::vector<std::string>>(
         "--sun",
         [&options](const std::vector<std::string>& texts) {
           const std::string form = "AZIMUTH,ELEVATION[,INTENSITY], intensity at least 0";
           options.lights.suns.clear();
           for (const std::string& text : texts) {
             const std::vector<double> numbers = parseNumbers("--sun", text, form);
             if (numbers.size() < 2 || numbers.size() > 3 || (numbers.size() == 3 && numbers[2] < 0))
               refuse("--sun", text, form);
             options.lights.suns.push_back(sunFrom(numbers, options.lights.suns.size()));
           }
         },
         "Where sunlight comes from, in degrees as for --view, and its irradiance; may be given again.")
      ->type_name("AZ,EL[,INTENSITY]")
      ->default_str("90,38,6.5")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  addNumbers(
      app, "--sky", "R,G,B", 3, 0, kAny, [&options](const Vec3f& v) { options.lights.sky = v; },
      "Radiance of the sky, the same in all directions.")
      ->default_str(
          fmt::format("{:g},{:g},{:g}", options.lights.sky.x, options.lights.sky.y, options.lights.sky.z));
}

void addMedium(CLI::App& app, PictureOptions& options) {
  app.add_option_function<double>(
         "--extinction",
         [&options](double value) {
           if (!(value >= 0 && value < 1e30))
             refuse("--extinction", fmt::format("{:g}", value), "a number of at least 0");
           options.extinction = float(value);
         },
         "Extinction per world unit where the density is 1.")
      ->type_name("NUMBER")
      ->default_str("150 / longest side of the volume");
  addNumbers(
      app, "--albedo", "R,G,B", 3, 0, 1, [&options](const Vec3f& v) { options.medium.albedo = v; },
      "Share of the light met that is scattered.")
      ->default_str(fmt::format("{:g},{:g},{:g}", options.medium.albedo.x, options.medium.albedo.y,
                                options.medium.albedo.z));
  app.add_option_function<std::string>(
         "--phase",
         [&options](const std::string& text) {
           try {
             options.medium.phase = Phase::parse(text);
           } catch (const Error&) {
             refuse("--phase", text, "isotropic or hg:G with G from -0.99 to 0.99");
           }
         },
         "Where scattered light goes: isotropic, or Henyey-Greenstein with mean cosine G.")
      ->type_name("isotropic|hg:G")
      ->default_str(fmt::format("hg:{:g}", options.medium.phase.meanCosine()));
  addCount(app, "--octaves", options.render.octaves.count, 1, 16,
           "Octaves of multiple scattering; 1 is single scattering.");
}

}  // namespace

void addPictureOptions(CLI::App& app, PictureOptions& options) {
  app.add_option("--grid", options.grid, "Grid of the file; default: the first that holds numbers.")
      ->type_name("NAME");
  addCamera(app, options);
  addLights(app, options);
  addMedium(app, options);
  addLength(app, "--step", options.step, "Longest step along a ray.", Sign::positive)
      ->default_str("one voxel");
  addCount(app, "--samples", options.render.samples, 1, 4096, "Rays per pixel.");
  app.add_option("--seed", options.render.seed, "Moves the pattern of the samples.")
      ->type_name("COUNT")
      ->capture_default_str();
  app.add_option("--aov", options.render.aovs,
                 "Layers beside R, G, B and A: none, or several of Z,transmittance,light.")
      ->type_name("LIST")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"Z", "transmittance", "light", "none"}))
      ->default_str("Z");
  app.add_option_function<double>(
         "--exposure", [&options](double stops) { options.screen.exposureStops = float(stops); },
         "Of the preview, in stops.")
      ->type_name("STOPS")
      ->check(CLI::Range(-20.0, 20.0))
      ->default_str("0");
  addNumbers(
      app, "--background", "R,G,B", 3, 0, kAny, [&options](const Vec3f& v) { options.background = v; },
      "Linear colour behind the preview.")
      ->default_str("the sky's");
}

Camera PictureOptions::camera(const RenderVolume& volume) const {
  if (!position) return Camera::framing(volume.outline(), view.x, view.y, frame);
  const Vec3f middle = volume.isEmpty() ? Vec3f{} : volume.worldBounds().center();
  return Camera::lookingAt(*position, lookAt.value_or(middle), up, frame);
}

PictureOptions PictureOptions::resolved(const RenderVolume& volume) const {
  PictureOptions result = *this;
  result.extinction = extinction.value_or(defaultExtinction(volume));
  result.medium.extinction = *result.extinction;
  if (step.value > 0) result.render.step = float(step.worldUnits(double(volume.worldBounds().longestSide())));
  if (lights.suns.empty()) result.lights.suns.push_back(sunFrom({90, 38}, 0));
  result.screen.background = background.value_or(lights.sky);
  std::erase(result.render.aovs, "none");
  return result;
}

RenderVolume readDensity(const std::string& path, const std::string& grid, Run& run) {
  run.begin("read");
  const VdbGrid vdb = readScalarGrid(path, grid);
  const VdbGridInfo info = describe(vdb);
  if (info.gridClass == VdbGridInfo::Class::levelSet)
    throw Error(fmt::format("{}: grid '{}' is a level set, not a density; 'nephele cloud' makes one of it",
                            path, info.name));
  // A brick holds 11^3 samples for 8^3 voxels, rarely all in use.
  const Vec3d size(info.indexMax - info.indexMin);
  run.requireMemory(
      25.0 * double(info.activeVoxels) + (size.x / 8 + 2) * (size.y / 8 + 2) * (size.z / 8 + 2) * 6,
      "make the volume with larger voxels");
  return RenderVolume(toBricks(vdb));
}

}  // namespace nephele::apps
