#pragma once

#include <optional>
#include <string>

#include "apps/app.h"
#include "apps/options/velocity_options.h"
#include "nephele/levelset/cloud/wisp_volume.h"
#include "nephele/modeling/cloud/wisp_guides.h"

namespace nephele::apps {

/// The options of the verb wisps as typed.
struct WispsArguments {
  enum class On { vertices, surface, volume };
  enum class Shape { ball, disc, streak };

  std::string input, output, points;
  std::optional<On> on;
  Shape shape = Shape::ball;
  double shapeSize = 1;

  GuideOptions guides;
  int guideCount = 6, seed = 0, dots = 600000, walkLength = 1000, resolution = 400;
  Length size{50, true}, dotRadius, voxelSize;
  double sizeVariation = 0.4, density = 5;

  WispOptions wisps;
  double correlation = 0, thickness = 0.05, clump = 0.6, amplitude = 1, frequency = 1, displacement = 0.5,
         displacementFrequency = 1, lacunarity = 2, roughness = 0.5, displacementRoughness = 0.5;
  int octaves = 3, displacementOctaves = 3;

  std::optional<VelocityArguments> velocity;
  std::string velocityGrid;
  float shutterOpen = 0, shutterClose = 0;
  bool halfFloat = false;
  const CLI::Option *guidesOption = nullptr, *dotRadiusOption = nullptr;

  /// The guides, read or scattered. @throws Error naming the file.
  std::vector<WispGuide> readGuides(Run& run) const;
  /// The library's options for these guides. @throws CLI::ValidationError where options exclude each other.
  WispVolumeOptions resolved(const std::vector<WispGuide>& made, const Run& run) const;
};

/// Declares the options on `app`.
void addWispsOptions(CLI::App& app, WispsArguments& arguments);

}  // namespace nephele::apps
