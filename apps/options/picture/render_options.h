#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/app.h"
#include "apps/options/picture/camera_options.h"
#include "apps/options/picture/light_options.h"
#include "apps/options/picture/quality_options.h"
#include "apps/options/picture/scale_options.h"
#include "apps/options/picture/view_options.h"
#include "apps/options/picture/volume_options.h"
#include "nephele/render/image/display_server.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"
#include "nephele/render/session/picture_stages.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele::apps {

/// What to look at, from where and in which light: the options that every verb that makes pictures takes.
struct PictureOptions : CameraOptions {
  VolumeOptions volumes;
  LightOptions light;
  /// Made from `light` by `resolved`.
  Lights lights;
  Medium medium;
  /// Of the medium, that of clouds of `scale` if not given.
  bool albedoGiven = false, phaseGiven = false;
  ScaleOptions scale;
  /// Of the volume if not given, see defaultExtinction.
  std::optional<float> extinction;
  Length step;
  double adaptiveThreshold = 0;
  RenderOptions render;
  Quality quality = Quality::good;
  /// As `quality` where it is not given.
  std::optional<Quality> lightQuality{};
  /// These say more than the quality does.
  bool samplesGiven = false, adaptiveGiven = false, pathsGiven = false;
  int seed = 0;
  /// Path traces instead of marching; what both have in common is taken from `render`.
  bool pathTraced = false;
  PathOptions path;
  ViewOptions view;
  /// Made from `view` by `withView`.
  ViewTransform screen;
  std::optional<DisplayServer::Options> displayServer;
  /// Behind the preview, where there is no backdrop; the sky's mean radiance if not given.
  std::optional<Vec3f> background;
  bool backdrop = false;

  /// These options with `screen` filled in, by `otherwise` where no view was asked for.
  /// @throws CLI::ValidationError or Error if there is no such view.
  PictureOptions withView(ViewCurve otherwise = ViewCurve::filmic) const;
  /// These options with everything filled in that follows from `volume`, or in a sequence from all of them.
  /// `lit`: the volume in the light of these options, where that has been made before: its lights and objects
  /// serve again.
  PictureOptions resolved(const RenderVolume& volume, const Run& run, const LitVolume* lit = nullptr) const;
  /// The longest step of rays through `volume`, which `resolved` chooses for its own; nothing: the marcher's.
  std::optional<float> stepThrough(const RenderVolume& volume) const;
  /// Whether a still reads the samples of the volume's grid after its light has been made.
  bool needsSamples() const;
  /// Whether a density that is coded is enough for all of it.
  bool readsCodes() const { return !needsSamples() && light.readsCodes(); }
  /// Whether light that is made in `volume` reads its samples.
  bool lightNeedsSamples(const RenderVolume& volume) const;
  /// `render` with the rays per pixel that suit `camera`, unless they were given.
  RenderOptions marched(const Camera& camera) const;
  /// `path`, with what both integrators have in common.
  PathOptions traced() const;
  /// That a picture will hold beside the volume, at most.
  double estimateBytes(const RenderVolume& volume, const Camera& camera) const;
  /// The volume of `stages` in these lights, whose objects it takes over: light of which only suns are new
  /// has those of the light before. `resolved` comes first.
  std::shared_ptr<const LitCloud> lit(PictureStages& stages, const PictureStages::Keys& keys,
                                      const Progress& progress);
  /// Marches or path traces; `resolved` comes first.
  RenderResult picture(const RenderVolume& volume, const Camera& camera, const Progress& progress) const;
  /// Puts the air before a picture that was made in these lights, and the backdrop behind it, where they are
  /// wanted.
  void addSky(Image& image, const Camera& camera, const Lights& its) const;
  /// What files say of a picture.
  std::map<std::string, std::string> metadata(const Run& run) const;

 private:
  void chooseByQuality();
  void chooseByScale(const RenderVolume& volume, const Run& run);
  // For the air alone, and not asked for as a layer.
  bool dropsMeanDepth_ = false;
};

/// Of a volume, without its typical density, which costs a pass over it.
Extent extentOf(const RenderVolume& volume);

/// Says so if the picture for `path` holds values that no file can; returns how many.
std::size_t noteNotFinite(const std::string& path, const Image& image, const Run& run);

/// Puts what a picture took into the statistics of `run`.
void tellWork(const RenderResult& result, Run& run);

/// Declares the options on `app`.
void addPictureOptions(CLI::App& app, PictureOptions& options);

}  // namespace nephele::apps
