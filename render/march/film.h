#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "nephele/render/image/deep_image.h"
#include "nephele/render/image/image.h"
#include "nephele/render/march/render_options.h"
#include "nephele/render/march/render_scene.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/lights.h"

namespace nephele {

/// What the rays of one pixel add up to.
struct PixelSum {
  float alpha = 0.0f;
  /// Per colour; alpha is their mean.
  Vec3f opacity{};
  Vec3f emission{};
  /// Opacity times albedo.
  Vec3f albedo{};
  /// Along the line of sight, where the nearest of the rays meets anything.
  float depth = std::numeric_limits<float>::infinity();
  /// As Lights::names, then objects.
  Vec3f light[2 * Lights::kMost + 2];
};

/// What the ray through a pixel's centre meets. Nothing of it is a mean over the pixel, so that no value lies
/// between those of things that only stand side by side in the picture.
struct PixelPoint {
  /// Along the line of sight: where half of the opacity is met, and the mean weighted by opacity.
  float medianDepth = std::numeric_limits<float>::infinity();
  float meanDepth = std::numeric_limits<float>::infinity();
  /// World space, at the median. The normal has length 1 or is zero.
  Vec3f position{}, normal{};
  /// Pixels per frame: right, down.
  float motion[2] = {};
};

/// The channels of a picture, its deep samples, and how a pixel fills them.
///
/// R, G, B, A, and the layers asked for by name: "Z", "Z_median", "Z_mean", "normal" (N.X, N.Y, N.Z),
/// "position" (P.X, P.Y, P.Z), "motion" (motion.X, motion.Y), "light" (light_<name>.R ...), "transmittance",
/// "albedo" and "emission" (.R, .G, .B). Layers hold floats.
class Film {
 public:
  /// @param lights their names, in the order of PixelSum::light. @throws Error if a layer is unknown or named
  /// twice.
  Film(const Camera& camera, const std::vector<std::string>& lights, const std::vector<std::string>& layers);
  /// With the lights and objects of `scene`. @throws Error as above, or if an option is outside its range.
  Film(const RenderScene& scene, const FilmOptions& options);

  const FilmOptions& options() const { return options_; }
  /// The pixels of the picture that are here, and the place of one of them in what follows.
  const PixelBox& window() const { return window_; }
  /// The whole picture, which the window is a part of.
  const PixelBox& picture() const { return picture_; }
  /// The pixels of the picture that may be integrated: those of the window, and where only some pixels are,
  /// as many around it as the others may depend on.
  PixelBox reach() const;
  std::size_t placeOf(int x, int y) const {
    return std::size_t(y - window_.y0) * std::size_t(window_.width()) + std::size_t(x - window_.x0);
  }

  void set(std::size_t at, const PixelSum& pixel);
  void set(std::size_t at, const PixelPoint& point);
  /// The samples of a pixel, where options().deep asks for them.
  void set(std::size_t at, std::vector<DeepSample> samples) { deep_->pixels[at] = std::move(samples); }
  /// Fills what PixelSum fills with the means of four pixels, Z with the nearest, where these agree: R, G and
  /// B within `threshold` of the brightest or of `faint`, A within `threshold`. Else does nothing and returns
  /// false.
  bool interpolate(std::size_t at, const std::array<std::size_t, 4>& from, float threshold, float faint);
  /// Any layer needs PixelPoint.
  bool wantsPoints() const { return medianDepth_ >= 0 || meanDepth_ >= 0 || wantsPositions(); }
  bool wantsPositions() const { return normal_ >= 0 || position_ >= 0 || motion_ >= 0; }
  bool wantsNormals() const { return normal_ >= 0; }
  bool wantsDepth() const { return depth_ >= 0; }

  /// A film of the same kind, empty, for other pixels of the picture. Not for deep pictures.
  Film part(const PixelBox& window) const;
  /// Takes over the pixels that both hold.
  void take(const Film& part);

  Image& image() { return image_; }
  /// Nothing where options().deep does not ask for it.
  std::optional<DeepImage>& deep() { return deep_; }

  /// Channels of `layers` where there are `lightCount` lights; unknown layers count as one.
  static std::size_t channelCount(const std::vector<std::string>& layers, std::size_t lightCount);
  /// The layers that there are, for help texts and checks.
  static const std::vector<std::string>& layerNames();

  /// Pixels from one to the next that is integrated first, where only some are.
  static constexpr int kFirstApart = 4;
  /// How far from a pixel those lie that it may depend on, of pixels `apart` from each other: each of those
  /// between is asked for its neighbours at half the distance, twice, and so on down to 1.
  static constexpr int reachOf(int apart) { return 2 * (apart - 1); }

 private:
  Film(const PixelBox& window, const PixelBox& picture, const std::vector<std::string>& lights,
       const std::vector<std::string>& layers);
  int addLayer(const std::string& name, const std::vector<std::string>& parts);
  void setColour(int channel, std::size_t at, const Vec3f& colour);
  void setMeans(int first, int count, std::size_t at, const std::array<std::size_t, 4>& from);
  float& value(int channel, std::size_t at) { return image_.channels[std::size_t(channel)].values[at]; }

  FilmOptions options_;
  PixelBox window_, picture_;
  std::vector<std::string> lights_, layers_;
  Image image_;
  std::optional<DeepImage> deep_;
  int depth_ = -1, medianDepth_ = -1, meanDepth_ = -1, normal_ = -1, position_ = -1, motion_ = -1;
  int transmittance_ = -1, albedo_ = -1, emission_ = -1, light_ = -1;
};

}  // namespace nephele
