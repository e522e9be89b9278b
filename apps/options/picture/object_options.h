#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/app.h"
#include "apps/options/picture/render_options.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/scene/surfaces.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele::apps {

/// What stands in the picture beside the volume.
struct ObjectOptions {
  std::vector<std::string> objects, holdouts;
  std::optional<Vec3f> colour;
  int checkers = 0;
  std::string texture;
  ColourEncoding textureEncoding = ColourEncoding::automatic;
  bool ground = false;
  /// Where it is not given, previews show a clear sky.
  std::optional<bool> backdrop;
  /// y of the ground, or above the lowest point in percent of the volume's longest side; the bottom of the
  /// volume if not given.
  std::optional<Length> groundHeight;
  Vec3f groundColour{0.3f, 0.3f, 0.3f};

  /// Of meshes and level sets that are the picture's only subject, of files of grids the one of this name, or
  /// else the first. @throws Error naming the file.
  std::vector<SurfaceObject> shapes(const std::vector<std::string>& paths,
                                    const std::vector<std::string>& grids, double mostBytes) const;
  bool any() const { return !objects.empty() || !holdouts.empty() || ground; }
  /// Reads the files, the ground under all that is `seen`; null where there are no objects. @throws Error
  /// naming the file.
  std::shared_ptr<const Surfaces> surfaces(const RenderVolume& volume, const Extent& seen,
                                           double mostBytes) const;
  /// Cameras stand above the ground, where no --view says otherwise.
  void lift(CameraOptions& camera) const;
  /// Whether a picture that is shown on screens, or not, has the sky behind it.
  bool showsBackdrop(const PictureOptions& picture, bool isShown) const;
  /// Puts them into `picture`, which is resolved, and is shown on screens, too, or not; they are read where
  /// it has none. @throws CLI::Error for options of objects where there are none, Error as `surfaces`.
  void addTo(PictureOptions& picture, const RenderVolume& volume, bool isShown, double mostBytes) const;
};

/// Declares the options on `app`.
void addObjectOptions(CLI::App& app, ObjectOptions& options);

}  // namespace nephele::apps
