#pragma once

#include <string>

#include "apps/app.h"
#include "apps/options/cloud_advection.h"
#include "apps/options/cloud_cache.h"
#include "apps/options/cloud_quantities.h"
#include "apps/options/density_options.h"
#include "apps/options/layer_recipe.h"
#include "apps/options/shape_options.h"
#include "nephele/levelset/cloud/cloud.h"

namespace nephele::apps {

/// The options of the verb cloud as typed.
struct CloudArguments {
  ShapeArguments shape;
  DensityArguments density;
  CloudAdvectionArguments advection;
  CloudCacheArguments cache;
  std::string output, surface;
  Length voxelSize;
  int resolution = 512, seed = 0;
  FieldValue amplitude = parseFieldValue("--amplitude", "2.5%", kAmplitude);
  FieldValue frequency = parseFieldValue("--frequency", "4.4x", kFrequency);
  FieldValue lacunarity = parseFieldValue("--lacunarity", "2.1", kLacunarity);
  FieldValue roughness = parseFieldValue("--roughness", "0.65", kRoughness);
  FieldValue billow = parseFieldValue("--billow", "0.5", kBillow);
  FieldValue billowScale = parseFieldValue("--billow-scale", "1", kBillowScale);
  FieldValue edgeThickness = parseFieldValue("--edge-thickness", "0.35%", kEdgeThickness);
  /// How far an amplitude and an edge that are given as one value go up and down from place to place.
  double amplitudeVariation = 0.6, edgeVariation = 2.5;
  /// 0: as many as the voxels can show.
  int layers = 0;
  /// What needs no conversion, the noise of the layers; the rest is filled in by `resolved`.
  CumuloFractal fractal;
  const CLI::Option* layersOption = nullptr;
  std::optional<double> noiseTime, noisePeriod;
  /// A second of 24 frames to a unit of time.
  double noiseSpeed = 1.0 / 24;
  std::vector<LayerRecipe> recipe;
  CloudOptions cloud;
  bool halfFloat = false;

  /// What the cloud grows on; its mesh is written where that is asked for. @throws as ShapeArguments::shape.
  Mesh shapeOf(const ShapeArguments& from, Run& run) const {
    return from.shape([this](double longestSide) { return voxel(longestSide); }, run);
  }
  /// World units, for a shape with this longest side.
  double voxel(double longestSide) const;
  /// What the parameters of a cloud on `mesh` are made from.
  FieldSources sources(const Mesh& mesh, const Run& run) const;
  /// The library's options. @throws Error naming an option whose field cannot be made.
  CloudOptions resolved(FieldSources& sources, const Run& run) const;
  /// Of the shape. @throws Error naming the file.
  Extent extent(Run& run) const;
  /// Files that the parameters of the layers are read from, beside the recipe.
  std::vector<std::string> maskFiles() const;
  /// Whether one of them is an expression of the time.
  bool asksForTime() const;
  /// What noise layer `index` has: "worley, 3 octaves".
  std::string noiseOf(std::size_t index) const;

 private:
  /// As typed, or those of the recipe; 0: as many as the voxels can show.
  int layerCount() const;
  std::vector<const FieldValue*> valuesOfLayers() const;
  FieldValue variedAmplitude() const;
  FieldValue variedEdge() const;
};

/// Declares the options on `app`.
void addCloudOptions(CLI::App& app, CloudArguments& arguments);

}  // namespace nephele::apps
