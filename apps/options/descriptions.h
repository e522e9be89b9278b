#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace nephele::apps {

/// What is in a file, in the order to show it: `kind` (mesh, volume, image) and what belongs to it.
using Description = nlohmann::ordered_json;

/// Reads a mesh, volume or image and describes it. Intersecting triangles of meshes with more than 500 000
/// triangles are counted only if `alwaysCountPairs`. @throws Error naming the path.
Description describeFile(const std::string& path, bool alwaysCountPairs);

}  // namespace nephele::apps
