#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "nephele/modeling/base/math.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/scene/lights.h"

namespace nephele {

/// A sky from a picture of all directions, a latitude-longitude map twice as wide as high.
///
/// Row 0 is up (+y), the middle of the picture is +z, and its right half is -x, as OpenEXR's maps have it:
/// the pixel at the share u of the width lies at the azimuth (0.5 - u) 360 degrees + rotation (see
/// directionTowards). Radiance is constant within a pixel. Cheap to copy.
class Environment {
 public:
  struct Options {
    float rotationDegrees = 0;
    /// Multiplies the radiance, 0 to 1e6.
    float intensity = 1;
    /// Whether `takeSpots` looks for any.
    bool hasSpots = true;
    /// Of a file's numbers.
    ColourEncoding encoding = ColourEncoding::automatic;
  };

  /// `radiance`: rows from the top. @throws Error if the size is not that of such a map, or a number is
  /// outside its range or not finite. Radiance below 0 counts as 0.
  Environment(int width, int height, std::vector<Vec3f> radiance, const Options& options);
  Environment(int width, int height, std::vector<Vec3f> radiance)
      : Environment(width, height, std::move(radiance), Options{}) {}
  /// From an OpenEXR, Radiance or PNG file with the channels R, G, B, or Y.
  /// @throws Error naming the path and what is wrong, also where its pixels need more than `mostBytes`.
  static Environment read(const std::string& path, const Options& options,
                          double mostBytes = std::numeric_limits<double>::infinity());
  static Environment read(const std::string& path) { return read(path, Options{}); }

  /// Turned by `degrees` about y, azimuths growing.
  Environment turned(double degrees) const;
  bool operator==(const Environment& other) const {
    return data_ == other.data_ && rotation_ == other.rotation_;
  }

  /// Radiance from a direction, of any length but zero.
  Vec3f radiance(const Vec3f& towards) const;
  /// The same as a picture of the sky is looked at: smoothed by a cubic B-spline over pixels. Towards the
  /// poles, where they get narrow, it spans as many of a row as are as wide together as they are high, so
  /// that it has no seam there.
  Vec3f smoothRadiance(const Vec3f& towards) const;
  /// Mean over all directions.
  Vec3f mean() const;
  /// Mean over the directions nearest to each of `towards`, all scaled so that their mean is the map's.
  /// Cost: directions times pixels.
  std::vector<Vec3f> around(const std::vector<Vec3f>& towards) const;

  struct Sample {
    Vec3f towards;
    /// Per steradian.
    float density;
  };
  /// A direction drawn in proportion to luminance, from four uniform numbers in [0, 1).
  Sample sample(float u1, float u2, float u3, float u4) const;
  /// Of `sample` at a direction; 0 everywhere if the map is black.
  float density(const Vec3f& towards) const;

  /// Takes away what is much brighter than what lies around it, the sun above all: up to `most` spots of 5
  /// degrees around, which hold at least a hundredth of the map's light and a pixel ten times its mean.
  /// Returns them as suns; together with what is left they send as much light as before.
  std::vector<DistantLight> takeSpots(int most);

 private:
  struct Data;

  Vec3f towards(double column, double cosine) const;
  std::size_t pixelAt(const Vec3f& towards) const;

  std::shared_ptr<const Data> data_;
  bool hasSpots_ = true;
  /// In (-180, 180].
  double rotation_ = 0;
};

}  // namespace nephele
