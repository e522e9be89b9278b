#pragma once

#include <string>

#include "apps/app.h"
#include "apps/cloud_advection.h"
#include "apps/density_options.h"
#include "apps/shape_options.h"
#include "levelset/cloud.h"

namespace nephele::apps {

/// The options of the verb cloud as typed.
struct CloudArguments {
  ShapeArguments shape;
  DensityArguments density;
  CloudAdvectionArguments advection;
  std::string output, surface;
  Length voxelSize, amplitude{2.5, true}, edgeThickness{0.35, true};
  Frequency frequency{4.4, true};
  int resolution = 256, seed = 0;
  std::string noise = "perlin";
  double lacunarity = 2.1, roughness = 0.55, billow = 1, billowScale = 1;
  /// What needs no conversion; the rest is filled in by `resolved`.
  CloudOptions cloud;

  /// The library's options for a shape with this box.
  CloudOptions resolved(const Box& shapeBox) const;
};

/// Declares the options on `app`.
void addCloudOptions(CLI::App& app, CloudArguments& arguments);

}  // namespace nephele::apps
