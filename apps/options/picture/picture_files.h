#pragma once

#include <map>
#include <string>

#include "apps/options/options.h"
#include "nephele/render/image/image_camera.h"
#include "nephele/render/image/view_transform.h"
#include "nephele/render/march/raymarch.h"

namespace nephele::apps {

/// Files of one picture, "" where there is to be none: linear (.exr), for the screen (.png), with depth
/// (.exr).
struct PictureFiles {
  std::string output, preview, deep;

  /// What messages call the picture: the first of its files.
  const std::string& name() const { return !output.empty() ? output : !preview.empty() ? preview : deep; }
  /// Writes those that are wanted. @throws Error naming the path.
  void write(const RenderResult& picture, const ImageCamera& camera, const ViewTransform& screen,
             const std::map<std::string, std::string>& metadata) const;
};

/// Declares --output and --preview on `app`.
void addPictureFiles(CLI::App& app, PictureFiles& files);

}  // namespace nephele::apps
