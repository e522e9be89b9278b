#include "apps/options/cloud_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/modeling/field/operations.h"

namespace nephele::apps {
double CloudArguments::voxel(double longestSide) const {
  return voxelSize.value > 0 ? voxelSize.worldUnits(longestSide) : longestSide / resolution;
}

int CloudArguments::layerCount() const {
  return recipe.empty() || layersOption->count() > 0 ? layers : int(recipe.size());
}

FieldValue CloudArguments::variedAmplitude() const {
  if (!amplitude.constant || amplitudeVariation == 0) return amplitude;
  // Calm parts are calmer than clumps are rough: bumps that are higher cost more.
  const std::string factors =
      fmt::format("*noise:2x,2:{},{}", 1 - amplitudeVariation, 1 + amplitudeVariation / 2);
  return parseFieldValue("--amplitude", amplitude.text + factors, kAmplitude);
}

FieldValue CloudArguments::variedEdge() const {
  if (!edgeThickness.constant || edgeVariation == 1) return edgeThickness;
  const std::string factors = fmt::format("*noise:3x:{},{}", 1 / edgeVariation, edgeVariation);
  return parseFieldValue("--edge-thickness", edgeThickness.text + factors, kEdgeThickness);
}

FieldSources CloudArguments::sources(const Mesh& mesh, const Run& run) const {
  // Few bumps rise above twice their rms; farther out look-ups are slower, not wrong.
  constexpr double kHighest = 2;
  const double longestSide = run.longestSide(boundingBox(mesh));
  const int count = layerCount() > 0 ? layerCount() : kMaxCumuloLayers;
  double rms = 0;
  for (int i = 0; i < count; ++i) {
    const bool hasOwn = std::size_t(i) < recipe.size() && recipe[std::size_t(i)].amplitude;
    const FieldValue given = hasOwn ? *recipe[std::size_t(i)].amplitude : variedAmplitude();
    rms += FieldSources::bound(given, mesh, seed, run) *
           (hasOwn ? 1 : std::pow(FieldSources::bound(roughness, mesh, seed, run), i));
  }
  return {mesh,
          {.voxelSize = voxel(longestSide),
           .reach = std::min(kHighest * rms, longestSide) +
                    2 * double(cloudEdgeReach(float(FieldSources::bound(variedEdge(), mesh, seed, run)),
                                              float(voxel(longestSide)))),
           .seed = seed},
          run};
}

CloudOptions CloudArguments::resolved(FieldSources& sources, const Run& run) const {
  CloudOptions result = cloud;
  result.voxelSize = float(sources.voxelSize());
  CumuloFractal form = fractal;
  form.layers = layerCount() > 0 ? layerCount() : kMaxCumuloLayers;
  const double passed = noiseSpeed * (run.part ? run.part->framesSinceFirst : 0);
  if (noiseTime) form.noise.time = float(*noiseTime + passed);
  if (noisePeriod) form.noise.period = float(*noisePeriod);
  form.amplitude = sources.field(variedAmplitude());
  form.frequency = sources.field(frequency);
  form.lacunarity = sources.field(lacunarity);
  form.roughness = sources.field(roughness);
  form.billow = sources.field(billow);
  form.billowScale = sources.field(billowScale);
  form.seed = std::uint32_t(seed);
  std::vector<LayerRecipe> now = recipe;
  for (LayerRecipe& layer : now)
    if (layer.time) *layer.time += float(passed);
  result.layers = recipeLayers(now, form, sources);
  if (layerCount() == 0) result.layers.resize(layersThatShow(result.layers, result.voxelSize));
  result.edgeThickness = sources.field(variedEdge());
  result.edgeExponent = density.edgeExponent;
  result.densityFactor = density.factor(sources, shape.isGenerated(), form.seed);
  result.withSurface = !surface.empty();
  return result;
}

Extent CloudArguments::extent(Run& run) const {
  if (shape.inputs.size() == 1) return extentOfFile(shape.inputs[0]);
  ShapeArguments only = shape;
  only.meshOutput.clear();
  const Box box = boundingBox(shapeOf(only, run));
  return {box, double(box.longestSide())};
}

std::vector<const FieldValue*> CloudArguments::valuesOfLayers() const {
  std::vector<const FieldValue*> values{&amplitude, &frequency, &lacunarity,
                                        &roughness, &billow,    &billowScale};
  for (const LayerRecipe& layer : recipe)
    for (const auto* value :
         {&layer.amplitude, &layer.frequency, &layer.billow, &layer.billowScale, &layer.mask})
      if (*value) values.push_back(&**value);
  return values;
}

std::vector<std::string> CloudArguments::maskFiles() const {
  std::vector<std::string> files;
  for (const FieldValue* value : valuesOfLayers())
    files.insert(files.end(), value->files.begin(), value->files.end());
  return files;
}

bool CloudArguments::asksForTime() const {
  return std::ranges::any_of(valuesOfLayers(), [](const FieldValue* value) {
    return value->expression.find("time") != std::string::npos;
  });
}

std::string CloudArguments::noiseOf(std::size_t index) const {
  const LayerRecipe own = index < recipe.size() ? recipe[index] : LayerRecipe{};
  const std::string kind(noiseName(own.noise.value_or(fractal.noise.kind)));
  return own.octaves > 1 ? fmt::format("{}, {} octaves", kind, own.octaves) : kind;
}

namespace {

void addLayerOptions(CLI::App& app, CloudArguments& a) {
  a.layersOption = addCount(app, "--layers", a.layers, 0, kMaxCumuloLayers,
                            "Layers of displacement; 0: as many as the voxels can show.");
  addFieldValue(app, "--amplitude", a.amplitude, "Rms height of the first layer's bumps.");
  addNumber(app, "--amplitude-variation", a.amplitudeVariation, 0, 1,
            "Share by which an --amplitude of one value goes down where the cloud is calm, and half of that "
            "up in its clumps.");
  addFieldValue(app, "--frequency", a.frequency, "Frequency of the first layer's bumps.");
  addFieldValue(app, "--lacunarity", a.lacunarity, "Frequency of a layer, in that of the one before.");
  addFieldValue(app, "--roughness", a.roughness, "Height of a layer, in that of the one before.");
  addFieldValue(app, "--billow", a.billow, "How clear valleys are kept of smaller bumps; 0: not at all.");
  addFieldValue(app, "--billow-scale", a.billowScale, "Height, in rms heights, from which bumps are full.");
  std::vector<std::pair<std::string, NoiseKind>> kinds;
  for (const NoiseKind kind : noiseKinds()) kinds.emplace_back(noiseName(kind), kind);
  addChoice<NoiseKind>(app, "--noise", a.fractal.noise.kind, kinds, "Noise of the layers.");
  auto* time =
      addOptional(app, "--noise-time", a.noiseTime, -1e6, 1e6,
                  "Set the noise in motion, and take it at this time, or the first of --frames: another "
                  "after about 1.");
  addNumber(app, "--noise-speed", a.noiseSpeed, -1e6, 1e6,
            "Time that passes for noises in motion from one of --frames to the next.")
      ->default_str("1/24");
  addOptional(app, "--noise-period", a.noisePeriod, 1e-3, 1e6,
              "Time after which the moving noise is the same again.")
      ->needs(time);
  app.add_option_function<std::string>(
         "--recipe", [&a](const std::string& path) { a.recipe = readLayerRecipe(path); },
         "TOML file with a [[layer]] for each layer; what it leaves open follows the options above.")
      ->type_name("FILE");
}

}  // namespace

void addCloudOptions(CLI::App& app, CloudArguments& a) {
  using Renormalise = CumuloGridOptions::Renormalise;
  addShapeOptions(app, a.shape);
  addOutput(app, "-o,--output", a.output, {".vdb"}, "Volume to write; its grid is called 'density'.")
      ->required();
  addOutput(app, "--surface", a.surface, {".vdb"},
            "Also write the displaced level set; its grid is called 'surface'.");
  auto* resolution =
      addCount(app, "--resolution", a.resolution, 1, 1000000, "Voxels along the longest side of the input.");
  addLength(app, "--voxel-size", a.voxelSize, "Edge of a voxel, instead of --resolution.", Sign::positive)
      ->excludes(resolution);
  addLayerOptions(app, a);
  addChoice<Renormalise>(
      app, "--renormalise", a.cloud.renormalise,
      {{"off", Renormalise::off}, {"sweep", Renormalise::sweep}, {"rebuild", Renormalise::rebuild}},
      "Turn each layer's surface back into a distance.");
  addCount(app, "--medial-smoothing", a.cloud.medialSmoothing, 0, kMaxMedialSmoothing,
           "Voxels by which jumps between facing parts are smoothed.");
  addFieldValue(app, "--edge-thickness", a.edgeThickness, "Width over which density rises to 1.");
  addNumber(app, "--edge-variation", a.edgeVariation, 1, 10,
            "Factor by which an --edge-thickness of one value goes up where veils are, and down elsewhere; "
            "1: the same everywhere.");
  addDensityOptions(app, a.density);
  addCloudAdvectionOptions(app, a.advection);
  addCloudCacheOptions(app, a.cache);
  addCount(app, "--seed", a.seed, 0, 1 << 30, "Another seed is another cloud of the same kind.");
  app.add_flag("--half", a.halfFloat, "Save 16-bit values.");
}

}  // namespace nephele::apps
