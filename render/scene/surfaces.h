#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/render/image/image.h"
#include "nephele/render/scene/camera.h"

namespace nephele {

/// Something opaque that stands in the picture together with a volume, or hides it.
struct SurfaceObject {
  /// Any polygons; both sides are seen. Texture coordinates are the corner attribute "uv".
  Mesh mesh;
  /// Share of the light that it scatters, evenly in all directions; multiplies checker and texture.
  Vec3f colour{0.5f, 0.5f, 0.5f};
  /// Fields of a chess board across the unit square of texture coordinates, at whose odd fields the colour is
  /// divided by four; 0: none.
  int checkers = 0;
  /// Colour in the unit square of texture coordinates, which repeats; linear, channels R, G, B, row 0 at v =
  /// 1. Interpolated linearly. Where it has an A below 1, `colour` shows through.
  std::shared_ptr<const Image> texture{};
  /// Hides what is behind it, and is not in the picture itself: black, with no opacity.
  bool isHoldout = false;
  /// Stands in the light of the volume.
  bool castsShadows = true;
};

/// All objects of a picture, ready for rays. Safe to use from many threads.
class Surfaces {
 public:
  /// Cost: n log n in the number of triangles. @throws Error naming the object's number and what is wrong: no
  /// faces, positions that are not finite, a checker or texture without texture coordinates; Cancelled.
  explicit Surfaces(std::vector<SurfaceObject> objects, const Progress& progress = silent());
  ~Surfaces();
  Surfaces(const Surfaces&) = delete;
  Surfaces& operator=(const Surfaces&) = delete;

  struct Hit {
    double distance = 0.0;
    /// Unit, smooth, on the side of the surface that the ray comes from; and that of the triangle itself.
    Vec3f normal{}, faceNormal{};
    Vec3f colour{};
    bool isHoldout = false;
  };

  /// What `ray` meets first.
  std::optional<Hit> hit(const Ray& ray) const;

  /// Whether anything that casts shadows is met within `distance`.
  bool occluded(const Ray& ray, double distance) const;
  bool castsShadows() const { return castsShadows_; }
  /// The distance to the first thing that casts shadows; infinite where `ray` meets none.
  double distanceToShade(const Ray& ray) const;

  /// Of all objects, and of those that cast shadows; the latter is empty where there are none.
  const Box& box() const { return box_; }
  const Box& shadeBox() const { return shadeBox_; }
  /// Of triangles, what rays need to find them, and textures.
  std::size_t memoryBytes() const;
  /// What objects of these meshes will hold, from above.
  static double estimateBytes(const Mesh& mesh);
  /// How far a ray that leaves a surface must start from it.
  double clearance() const { return clearance_; }

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
  std::vector<SurfaceObject> objects_;
  Box box_, shadeBox_;
  double clearance_ = 0;
  bool castsShadows_ = false;
};

/// A horizontal square at height `height` about `centre`, `size` wide: the ground. It is made of squares,
/// each ten times as wide as the one within, so that rays find places near its middle as exactly as on a
/// small one.
Mesh groundPlane(const Vec3f& centre, float height, float size);

}  // namespace nephele
