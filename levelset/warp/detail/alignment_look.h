#pragma once

#include <ceres/solver.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "nephele/levelset/mesh/exact_distance.h"

/// What both alignments look at: distances to a shape in a frame of unit size.
namespace nephele::detail {

/// Points of each shape that the first fits use.
inline constexpr int kStartPoints = 120;

/// A shape moved to the origin and scaled to unit size, so that one set of constants fits all.
struct AlignmentFrame {
  Vec3d centre;
  double size;

  explicit AlignmentFrame(const ExactDistance& shape) : centre(shape.centre()), size(shape.size()) {}
  Vec3d toLocal(const Vec3d& p) const { return (p - centre) / size; }
  Vec3d toWorld(const Vec3d& p) const { return p * size + centre; }
};

/// Points evenly spread over the surface by area, in the shape's frame: one in each of `count` shares of the
/// area, in the order of the triangles.
std::vector<Vec3d> surfacePoints(const ExactDistance& shape, int count, std::uint32_t seed);

struct LookSample {
  double value;
  Vec3d gradient;
};

/// The distance to a shape in its frame.
class Look {
 public:
  virtual ~Look() = default;
  /// `cursor`: of an earlier place of the same point, or of one near it.
  virtual LookSample at(const Vec3d& p, ExactDistance::Cursor& cursor) const = 0;
};

class ExactLook final : public Look {
 public:
  explicit ExactLook(const ExactDistance& shape) : shape_(shape), frame_(shape) {}
  LookSample at(const Vec3d& p, ExactDistance::Cursor& cursor) const override {
    const ExactDistance::Hit hit = shape_.at(frame_.toWorld(p), cursor);
    return {hit.distance / frame_.size, hit.gradient};
  }

 private:
  const ExactDistance& shape_;
  AlignmentFrame frame_;
};

/// Least squares with far residuals counted by their size only: the root of twice the pseudo-Huber loss.
struct Softened {
  double width;

  double operator()(double r, double& slope) const {
    const double s = r / width, root = std::sqrt(1 + s * s);
    // root - 1 without cancellation.
    const double value = r * std::sqrt(2 / (1 + root));
    slope = r == 0 ? 1.0 : r / root / value;
    return value;
  }
};

/// Of a fit with so many steps: on one thread, silent.
ceres::Solver::Options solverOptions(int steps);

}  // namespace nephele::detail
