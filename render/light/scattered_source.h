#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "nephele/render/light/light_volume.h"

namespace nephele {

/// Where light comes from: a beam through the volume, the sky around it, or what glows in it.
struct ScatteredSource {
  /// Irradiance of the beam at a world-space point without the volume.
  std::function<float(const Vec3f&)> irradiance;
  /// The density on the beam's way to points, see LightVolume::columnDensities.
  std::function<void(std::span<const Vec3f> world, std::span<float> columns)> columns;
  /// A lower bound of it between points, see LightVolume::leastColumnDensity; 0 where there is none.
  std::function<float(std::span<const Vec3f> world)> leastColumn;
  /// Multiplies the extinction on that way.
  float shadow = 1.0f;
  /// The columns of a thinned volume, whose density is `most` at most; beyond `dark` they need not be known.
  /// Where there are none, as for lights whose shadows hold more than the volume's, all cells are thinned
  /// alike.
  std::function<std::shared_ptr<const LightVolume>(float most, float dark)> thinned;
  /// Where the beam comes from: a direction towards it, or a place.
  std::optional<Vec3f> towards, place;
  /// Radiance of the sky in each of some unit directions, which stand for about equal shares of the sphere.
  std::function<std::vector<float>(const std::vector<Vec3f>&)> sky;
  /// Radiance per optical depth of what glows at a point; then there is no beam.
  std::function<float(const Vec3f&)> glow;

  /// A light of irradiance 1 everywhere, whose column densities are `sun`.
  static ScatteredSource of(const LightVolume& sun, const Vec3f& towards);
  /// Takes the column densities of `sun`, which must outlive every use of them.
  void setColumns(const LightVolume& sun);
  /// A sky of radiance 1.
  static ScatteredSource evenSky();
};

}  // namespace nephele
