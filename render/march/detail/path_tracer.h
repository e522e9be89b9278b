#pragma once

#include <cstdint>
#include <vector>

#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/math.h"
#include "nephele/render/march/detail/path_random.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/scene/environment.h"
#include "nephele/render/volume/lattice_ray.h"
#include "nephele/render/volume/march_scene.h"

namespace nephele::detail {

/// What the paths of one pixel add up to.
struct PathSums {
  std::uint64_t scatterings = 0;
  /// Paths that meet anything; where colours differ in extinction, the share of each that does.
  Vec3d opacity{};
  Vec3d emission{};
  /// As Lights::names.
  std::vector<Vec3d> light;
};

/// Follows the paths of a picture. What it is made from must outlive it.
class PathTracer {
 public:
  PathTracer(const RenderScene& scene, const PathOptions& options);
  /// Traces the paths of a pixel and adds them to `sums`.
  void pixel(int x, int y, PathSums& sums) const;

 private:
  struct Sun {
    Vec3f towards, lattice, irradiance, shadow;
  };

  // Tentative collisions along `length` of a ray, by delta tracking: calls meet(s, bound, pool) at each
  // until it returns false; boundOf(pool) is an extinction that none in the brick exceeds.
  template <class BoundOf, class Meet>
  void collide(const LatticeRay& ray, float length, PathRandom& random, BoundOf&& boundOf, Meet&& meet) const;
  // Distance to the next collision from the origin of `ray`; infinite if it leaves the volume.
  float freePath(const LatticeRay& ray, PathRandom& random) const;
  // The same where colours differ in extinction or something glows. A tentative collision is real by a chance
  // that lies between those of the colours, by their weights, and each weight makes up for it (spectral
  // tracking, Kutz, Habel, Li and Novak 2017); at each one the path sees what glows there per extinction.
  float freePath(const LatticeRay& ray, Vec3f& weight, Vec3d& glow, PathRandom& random) const;
  // The same in three colours whose shadows are multiplied by `shadow`.
  Vec3f transmittance(const LatticeRay& ray, float length, const Vec3f& shadow, PathRandom& random) const;
  // An unbiased estimate of exp(-shadow * optical depth) along `length` from the origin of `ray` on.
  float transmittance(const LatticeRay& ray, float length, float shadow, PathRandom& random) const;
  float density(const Vec3f& p) const;
  // What the albedo is multiplied by.
  Vec3f colour(const Vec3f& p) const;
  // As the marcher interpolates.
  static float valueAt(const MarchScene::Bricks& bricks, const Vec3f& p);
  // A ray through any point of the lens at any time, as the volume sees it.
  Ray blurredRay(double x, double y, PathRandom& random) const;
  // Where a ray of the camera enters the volume; false if it misses it.
  bool enter(const Ray& ray, LatticeRay& out) const;
  void trace(const Ray& camera, PathRandom& random, PathSums& sums) const;
  // What a light at a place sends on along a path.
  Vec3d local(const LocalLight& light, const Vec3f& at, const Vec3f& direction, const Vec3f& weight,
              PathRandom& random) const;
  // The sky in a direction drawn from the map.
  Vec3d drawnSky(const Vec3f& at, const Vec3f& direction, const Vec3f& weight, PathRandom& random) const;

  Medium medium_;
  const Lights& lights_;
  const Environment* skyMap_ = nullptr;
  Affine latticeToWorld_;
  const Camera& camera_;
  Shutter shutter_;
  const RigidMotion* motion_;
  const PathOptions& options_;
  MarchScene scene_;
  std::vector<Sun> suns_;
  Affine map_;
  Vec3d shift_;
  Box bounds_;
  // Extinction of every colour relative to the largest, and of density 1.
  Vec3f colour_{1, 1, 1};
  float perEmission_ = 0.0f;
  // Of the extinction where something glows, which may have none.
  float leastBound_ = 0.0f;
  bool isColoured_ = false;
  bool hasSky_ = false;
  bool blurred_ = false;
  // Makes walks end whatever the extinction is.
  float leastStep_ = 0.0f;
};

}  // namespace nephele::detail
