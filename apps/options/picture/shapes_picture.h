#pragma once

#include <string>
#include <vector>

#include "apps/options/picture/picture_files.h"
#include "apps/options/picture/scene_options.h"

namespace nephele::apps {

/// Whether files hold surfaces only: meshes, or level sets as the grids of these names, one for each file; ""
/// is the first that holds numbers. @throws Error naming the file.
bool areShapes(const std::vector<std::string>& paths, const std::vector<std::string>& grids);

/// Of meshes and level sets, likewise. @throws Error naming the file.
Extent extentOfShapes(const std::vector<std::string>& inputs, const std::vector<std::string>& grids,
                      const ObjectOptions& objects, const Run& run);

/// Writes a picture of meshes and level sets alone, shaded quickly in a light of their own. The camera, the
/// view transform and the paint of objects are those of the options, which `app` has read.
/// @throws CLI::Error for a camera that cannot be, and what shows beside a volume only: depth, layers,
/// objects, holdouts; Error naming the file.
void writeShapesPicture(const CLI::App& app, const SceneOptions& scene, const PictureOptions& options,
                        const PictureFiles& files, Run& run);

}  // namespace nephele::apps
