#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/app.h"
#include "render/camera.h"
#include "render/image.h"
#include "render/raymarch.h"

namespace nephele::apps {

/// What to look at, from where and in which light: the options that every verb that makes pictures takes.
struct PictureOptions {
  std::string grid;
  Camera::Frame frame;
  /// Azimuth and elevation of a camera that frames the volume; `position` takes its place where it is given.
  Vec3f view{25, 5, 0};
  std::optional<Vec3f> position, lookAt;
  Vec3f up{0, 1, 0};
  /// Without suns: one at 63 degrees azimuth, 44 degrees elevation.
  Lights lights{{}, {0.10f, 0.17f, 0.28f}};
  Medium medium;
  /// Of the volume if not given, see defaultExtinction.
  std::optional<float> extinction;
  Length step;
  RenderOptions render;
  ViewTransform screen;
  /// Behind the preview; the sky's radiance if not given.
  std::optional<Vec3f> background;

  /// The camera that these options place around `volume`.
  Camera camera(const RenderVolume& volume) const;
  /// These options with everything filled in that follows from `volume`.
  PictureOptions resolved(const RenderVolume& volume) const;
};

/// Declares the options on `app`.
void addPictureOptions(CLI::App& app, PictureOptions& options);

/// Reads a density as it is marched.
/// @throws Error naming the path if it is a level set or larger than the memory allowed.
RenderVolume readDensity(const std::string& path, const std::string& grid, Run& run);

}  // namespace nephele::apps
