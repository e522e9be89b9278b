#include "apps/cloud_options.h"

namespace nephele::apps {

CloudOptions CloudArguments::resolved(const Box& shapeBox) const {
  const double longestSide = shapeBox.longestSide();
  CloudOptions result = cloud;
  result.voxelSize =
      float(voxelSize.value > 0 ? voxelSize.worldUnits(longestSide) : longestSide / resolution);
  result.layers.amplitude = float(amplitude.worldUnits(longestSide));
  result.layers.frequency = float(frequency.perWorldUnit(longestSide));
  result.layers.lacunarity = float(lacunarity);
  result.layers.roughness = float(roughness);
  result.layers.billow = float(billow);
  result.layers.billowScale = float(billowScale);
  result.layers.seed = std::uint32_t(seed);
  result.edgeThickness = float(edgeThickness.worldUnits(longestSide));
  result.edgeExponent = density.edgeExponent;
  result.densityFactor = density.factor(shapeBox, shape.isGenerated(), result.layers.seed);
  result.withSurface = !surface.empty();
  return result;
}

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
  addCount(app, "--layers", a.cloud.layers.layers, 1, kMaxCumuloLayers, "Layers of displacement.");
  addLength(app, "--amplitude", a.amplitude, "Rms height of the first layer's bumps.", Sign::notNegative);
  addFrequency(app, "--frequency", a.frequency, "Frequency of the first layer's bumps.");
  addNumber(app, "--lacunarity", a.lacunarity, 0.1, 100, "Frequency of a layer, in that of the one before.");
  addNumber(app, "--roughness", a.roughness, 0, 10, "Height of a layer, in that of the one before.");
  addNumber(app, "--billow", a.billow, 0, 100, "How clear valleys are kept of smaller bumps; 0: not at all.");
  addNumber(app, "--billow-scale", a.billowScale, 0.01, 100,
            "Height, in rms heights, from which bumps are full.");
  addChoice<std::string>(app, "--noise", a.noise, {{"perlin", "perlin"}}, "Noise of the layers.");
  addChoice<Renormalise>(
      app, "--renormalise", a.cloud.renormalise,
      {{"off", Renormalise::off}, {"sweep", Renormalise::sweep}, {"rebuild", Renormalise::rebuild}},
      "Turn each layer's surface back into a distance.");
  addCount(app, "--medial-smoothing", a.cloud.medialSmoothing, 0, kMaxMedialSmoothing,
           "Voxels by which jumps between facing parts are smoothed.");
  addLength(app, "--edge-thickness", a.edgeThickness, "Width over which density rises to 1.", Sign::positive);
  addDensityOptions(app, a.density);
  addCloudAdvectionOptions(app, a.advection);
  addCount(app, "--seed", a.seed, 0, 1 << 30, "Another seed is another cloud of the same kind.");
  app.add_flag("--half", a.cloud.halfFloat, "Save 16-bit values.");
}

}  // namespace nephele::apps
