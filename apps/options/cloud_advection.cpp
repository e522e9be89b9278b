#include "apps/options/cloud_advection.h"

#include <algorithm>
#include <cmath>

#include "apps/options/velocity_options.h"
#include "nephele/levelset/flow/advection.h"
#include "nephele/levelset/flow/advection_files.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"
#include "nephele/render/scene/lights.h"

namespace nephele::apps {

float CloudAdvectionArguments::farthest(FieldSources& sources, const ScalarField& way) const {
  return way.range(sources.box().expanded(float(sources.longestSide()) / 2)).max;
}

bool CloudAdvectionArguments::isAny(FieldSources& sources) const {
  return wind || farthest(sources, sources.field(strength)) > 0;
}

VdbGrid CloudAdvectionArguments::carried(const VdbGrid& density, FieldSources& sources, int seed,
                                         Run& run) const {
  const double longestSide = sources.longestSide();
  const ScalarField way = sources.field(strength);
  const float most = farthest(sources, way);
  if (most == 0 && !wind) return density;
  run.begin("advect");
  VelocityArguments velocity;
  velocity.amplitude = {double(most) / steps, false};
  velocity.frequency = frequency;
  velocity.octaves = 4;
  velocity.roughness = 0.6;
  velocity.seed = seed;
  const AdvectionOptions options{
      .method = AdvectionMethod::gridless, .steps = steps, .mostBytes = run.memoryLimitBytes};
  const CarriedGrids grids = carriedGrids({density});
  if (grids.box.isEmpty()) return density;
  run.requireMemory(estimatedAdvectionBytes(grids.bricks, options),
                    "use larger voxels (a lower --resolution or a larger --voxel-size)");
  VectorField carrier = Vec3f{};
  if (most > 0) carrier = velocity.field(longestSide) * (way / most);
  if (wind) carrier = carrier + windOver(sources, seed);
  return toVdb(grids, advectGrids(grids.bricks, carrier, options, run).grids).front();
}

// Most of the cloud stays where it is; where smooth noise is high, wind takes it along.
VectorField CloudAdvectionArguments::windOver(const FieldSources& sources, int seed) const {
  constexpr float kStays = 0.3f, kGoes = 1.6f;
  const double longestSide = sources.longestSide();
  const ScalarField loose =
      smoothstep(kStays, kGoes,
                 fractalSum({.octaves = 3,
                             .frequency = float(frequency.perWorldUnit(longestSide)) / 2,
                             .seed = std::uint32_t(seed) + 1}));
  const Box& box = sources.box();
  const float height = std::max(box.size().y, 1e-6f * float(longestSide));
  const ScalarField above = clamp(plane({0, box.min.y, 0}, {0, 1, 0}) / height, 0, 1);
  const ScalarField share = loose * (1 - wind->shear + wind->shear * above);
  return VectorField(wind->direction * float(wind->way.worldUnits(longestSide) / steps)) * share;
}

namespace {

void addWind(CLI::App& app, CloudAdvectionArguments& a) {
  const std::string form =
      "FROM,WAY[,SHEAR]: degrees, a length above 0 in world units or percent, and a share from 0 to 1";
  app.add_option_function<std::string>(
         "--wind",
         [&a, form](const std::string& text) {
           const std::size_t first = text.find(','), second = text.find(',', first + 1);
           if (first == std::string::npos) refuseValue("--wind", text, form);
           std::string way =
               text.substr(first + 1, second == std::string::npos ? second : second - first - 1);
           Wind wind;
           wind.way.relative = way.ends_with('%');
           if (wind.way.relative) way.pop_back();
           const auto from = parseNumber(text.substr(0, first)), length = parseNumber(way),
                      shear = second == std::string::npos ? std::optional(1.0)
                                                          : parseNumber(text.substr(second + 1));
           if (!from || !length || !(*length > 0 && *length <= 1e9) || !shear ||
               !(*shear >= 0 && *shear <= 1))
             refuseValue("--wind", text, form);
           wind.direction = -directionTowards(float(*from), 0);
           wind.way.value = *length;
           wind.shear = float(*shear);
           a.wind = wind;
         },
         "Wind from an azimuth that draws streaks of the finished density to the lee, WAY long at the top, "
         "and "
         "by the share SHEAR shorter at the bottom (1 if not given).")
      ->type_name("FROM,WAY[,SHEAR]")
      ->default_str("none");
}

}  // namespace

void addCloudAdvectionOptions(CLI::App& app, CloudAdvectionArguments& a) {
  addFieldValue(
      app, "--advect", a.strength,
      "Way by which noise carries the finished density: ragged edges and wisps; see nephele advect.");
  addFrequency(app, "--advect-frequency", a.frequency, "Frequency of that noise.");
  addWind(app, a);
  addCount(app, "--advect-steps", a.steps, 1, 1000, "Steps in which it goes; fewer fold and tear more.");
}

}  // namespace nephele::apps
