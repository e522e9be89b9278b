#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <string>

namespace nephele::apps {

/// What is in a file, in the order to show it: `kind` (mesh, volume, image) and what belongs to it.
using Description = nlohmann::ordered_json;

struct DescriptionOptions {
  /// Counts intersecting triangles also of meshes with more than 500 000 triangles.
  bool alwaysCountPairs = false;
  /// What pixels may take that must be held to be looked at.
  double mostBytes = std::numeric_limits<double>::infinity();
};

/// Reads a mesh, volume or image and describes it. @throws Error naming the path.
Description describeFile(const std::string& path, const DescriptionOptions& options = {});

}  // namespace nephele::apps
