#pragma once

#include <memory>
#include <span>
#include <vector>

#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/levelset/mesh/range_tree.h"

/// What the fields of attributes are made of. Not for other folders.
namespace nephele::detail {

/// Weights of the corners a, b, c at the point of their triangle nearest to `p`, which lies on it but for
/// rounding: none negative, sum 1. Slivers count as their longest side.
Vec3d barycentrics(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// Numbers on the surface of a triangle mesh.
class SurfaceValues {
 public:
  virtual ~SurfaceValues() = default;

  /// The number at a point of `triangle`, given by the weights of its corners.
  virtual float at(std::uint32_t triangle, const Vec3d& weights) const = 0;
  /// Bounds over a triangle.
  virtual Interval over(std::uint32_t triangle) const = 0;
  virtual float atVertex(std::uint32_t vertex) const = 0;
};

/// Values at vertices, linear over each triangle. `corners` are the mesh's.
std::unique_ptr<SurfaceValues> linearValues(const std::vector<std::uint32_t>& corners,
                                            std::vector<float> values);

/// Cosine between the smooth normal and `direction`, which has length 1.
std::unique_ptr<SurfaceValues> facingValues(const Mesh& triangles, const Vec3f& direction);

/// A triangle mesh, its nearest points, and numbers on it.
class ValuedSurface {
 public:
  ValuedSurface(const Mesh& triangles, std::unique_ptr<SurfaceValues> values);

  /// Continues from the last answer, which bounds the next one.
  struct Cursor {
    Vec3f point{};
    bool hasPoint = false;
  };
  /// The number at the point of the surface nearest to `p`; NaN if `p` is not finite.
  float at(const Vec3f& p, Cursor& cursor) const;
  /// The same at the 8^3 samples voxelSize * (firstVoxel + (x, y, z)), x fastest, several times as fast each.
  void atBrick(const Vec3i& firstVoxel, float voxelSize, std::span<float, 512> values) const;
  /// Bounds of `at` over `box`.
  Interval range(const Box& box) const;
  /// Bounds of everything.
  Interval range() const { return *ranges_.all(); }
  const NearestOnMesh& nearest() const { return nearest_; }

 private:
  std::vector<Vec3d> positions_;
  std::vector<std::uint32_t> corners_;
  std::unique_ptr<SurfaceValues> values_;
  NearestOnMesh nearest_;
  RangeTree ranges_;
};

}  // namespace nephele::detail
