// The bend of an aligned object: control points of cubic B-splines, found by least squares of distances. See
// alignment.cpp.
#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/levelset/warp/alignment.h"
#include "nephele/levelset/warp/detail/alignment_look.h"
#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

constexpr int kPerAxis = 5, kControls = kPerAxis * kPerAxis * kPerAxis;

/// The 64 control points that have a say at a point, and their weights.
struct Stencil {
  std::array<int, 64> index;
  std::array<double, 64> weight;
};

Stencil stencilAt(const Vec3d& low, const Vec3d& high, const Vec3d& p) {
  int first[3];
  double w[3][4];
  for (int c = 0; c < 3; ++c) {
    constexpr int kSpans = kPerAxis - 3;
    const double side = high[c] - low[c];
    const double u = side > 0 ? std::clamp((p[c] - low[c]) / side, 0.0, 1.0) * kSpans : 0.0;
    first[c] = std::min(int(u), kSpans - 1);
    const double t = u - first[c], s = 1 - t;
    w[c][0] = s * s * s / 6;
    w[c][1] = (3 * t * t * t - 6 * t * t + 4) / 6;
    w[c][2] = (3 * s * s * s - 6 * s * s + 4) / 6;
    w[c][3] = t * t * t / 6;
  }
  Stencil result;
  std::size_t next = 0;
  for (int z = 0; z < 4; ++z)
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 4; ++x, ++next) {
        result.index[next] = first[0] + x + kPerAxis * (first[1] + y + kPerAxis * (first[2] + z));
        result.weight[next] = w[0][x] * w[1][y] * w[2][z];
      }
  return result;
}

Vec3d displacementOf(const Stencil& stencil, const double* control) {
  Vec3d sum;
  for (std::size_t k = 0; k < 64; ++k) {
    const double* c = control + 3 * stencil.index[k];
    sum += Vec3d(c[0], c[1], c[2]) * stencil.weight[k];
  }
  return sum;
}

/// A point of the aligned object that should lie on a plane.
struct PlanePoint {
  Stencil stencil;
  Vec3d from, to, normal;
};

struct LatticePoint {
  Stencil stencil;
  Vec3d from;
};

/// Object points in the reference, reference points on planes, second differences of control points.
class LatticeCost final : public ceres::CostFunction {
 public:
  LatticeCost(const detail::Look& reference, std::vector<LatticePoint> points, std::vector<PlanePoint> planes,
              double smoothness)
      : reference_(reference),
        points_(std::move(points)),
        planes_(std::move(planes)),
        cursors_(points_.size()) {
    for (int z = 0; z < kPerAxis; ++z)
      for (int y = 0; y < kPerAxis; ++y)
        for (int x = 0; x < kPerAxis; ++x) addDifferences(x, y, z);
    weight_ = std::sqrt(smoothness / double(differences_.size()));
    set_num_residuals(int(points_.size() + planes_.size() + 3 * differences_.size()));
    mutable_parameter_block_sizes()->push_back(3 * kControls);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const double* const control = parameters[0];
    double* row = jacobians ? jacobians[0] : nullptr;
    if (row) std::fill_n(row, std::size_t(num_residuals()) * 3 * kControls, 0.0);
    const auto addRow = [&](const Stencil& stencil, const Vec3d& g) {
      if (!row) return;
      for (std::size_t k = 0; k < 64; ++k)
        for (int c = 0; c < 3; ++c) row[3 * stencil.index[k] + c] = stencil.weight[k] * g[c];
      row += 3 * kControls;
    };
    constexpr double kWidth = 0.05;
    const detail::Softened soften{kWidth};
    double slope = 0;
    const double perPoint = 1 / std::sqrt(double(points_.size()));
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const LatticePoint& point = points_[i];
      const detail::LookSample l =
          reference_.at(point.from + displacementOf(point.stencil, control), cursors_[i]);
      *residuals++ = perPoint * soften(l.value, slope);
      addRow(point.stencil, l.gradient * (slope * perPoint));
    }
    const double perPlane = 1 / std::sqrt(double(std::max<std::size_t>(planes_.size(), 1)));
    for (const PlanePoint& plane : planes_) {
      const Vec3d at = plane.from + displacementOf(plane.stencil, control);
      *residuals++ = perPlane * soften(dot(at - plane.to, plane.normal), slope);
      addRow(plane.stencil, plane.normal * (slope * perPlane));
    }
    for (const Difference& d : differences_)
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (std::size_t k = 0; k < 4; ++k) sum += d.weight[k] * control[3 * d.index[k] + c];
        *residuals++ = weight_ * sum;
        if (!row) continue;
        for (std::size_t k = 0; k < 4; ++k) row[3 * d.index[k] + c] += weight_ * d.weight[k];
        row += 3 * kControls;
      }
    return true;
  }

 private:
  struct Difference {
    std::array<int, 4> index;
    std::array<double, 4> weight;
  };

  /// Those that start at (x, y, z): along each axis, and mixed for each pair of axes (twice in the sum of
  /// squares).
  void addDifferences(int x, int y, int z) {
    const int at[3] = {x, y, z}, stride[3] = {1, kPerAxis, kPerAxis * kPerAxis};
    const int here = x + stride[1] * y + stride[2] * z;
    for (int a = 0; a < 3; ++a) {
      if (at[a] + 2 < kPerAxis)
        differences_.push_back({{here, here + stride[a], here + 2 * stride[a], here}, {1, -2, 1, 0}});
      const int b = (a + 1) % 3;
      const double twice = std::sqrt(2.0);
      if (at[a] + 1 < kPerAxis && at[b] + 1 < kPerAxis)
        differences_.push_back({{here, here + stride[a], here + stride[b], here + stride[a] + stride[b]},
                                {twice, -twice, -twice, twice}});
    }
  }

  const detail::Look& reference_;
  std::vector<LatticePoint> points_;
  std::vector<PlanePoint> planes_;
  mutable std::vector<ExactDistance::Cursor> cursors_;
  std::vector<Difference> differences_;
  double weight_ = 0;
};

}  // namespace

Vec3d BendLattice::operator()(const Vec3d& p) const {
  const Stencil stencil = stencilAt(low, high, p);
  Vec3d sum = p;
  for (std::size_t k = 0; k < 64; ++k) sum += control[std::size_t(stencil.index[k])] * stencil.weight[k];
  return sum;
}

BendLattice alignLattice(const ExactDistance& reference, const ExactDistance& object,
                         const Similarity& similarity, const LatticeOptions& options,
                         const Progress& progress) {
  require(options.pointCount >= detail::kStartPoints,
          fmt::format("alignment: pointCount must be at least {}, got {}", detail::kStartPoints,
                      options.pointCount));
  require(options.smoothness > 0 && std::isfinite(options.smoothness),
          fmt::format("alignment: smoothness must be > 0, got {}", options.smoothness));
  const detail::AlignmentFrame source(object), target(reference);
  const detail::ExactLook look(reference);
  const auto aligned = [&](const Vec3d& p) { return target.toLocal(similarity(p)); };
  // The box of the whole aligned object, in the frame of the reference.
  Vec3d low(1e30, 1e30, 1e30), high = -low;
  for (const std::uint32_t v : object.mesh().corners) {
    const Vec3d p = aligned(object.mesh().positions[v]);
    low = min(low, p);
    high = max(high, p);
  }
  std::vector<LatticePoint> points;
  for (const Vec3d& p : detail::surfacePoints(object, options.pointCount, options.seed)) {
    const Vec3d from = aligned(source.toWorld(p));
    points.push_back({stencilAt(low, high, from), from});
  }
  const std::vector<Vec3d> wanted = detail::surfacePoints(reference, options.pointCount, options.seed);

  std::vector<double> control(3 * kControls);
  constexpr int kRounds = 3, kSteps = 5;
  for (int round = 0; round < kRounds; ++round) {
    progress.check();
    // Each reference point asks for the place of the bent object that was nearest in the round before: found
    // by taking the point back through the bend, approximately, and then to the nearest point of the object.
    std::vector<PlanePoint> planes;
    ExactDistance::Cursor ofObject, ofReference;
    for (const Vec3d& to : wanted) {
      const Vec3d before = to - displacementOf(stencilAt(low, high, to), control.data());
      const Vec3d world = (target.toWorld(before) - similarity.shift) / similarity.scale;
      const Vec3d from = aligned(object.at(similarity.turnedBack(world), ofObject).point);
      planes.push_back({stencilAt(low, high, from), from, to, look.at(to, ofReference).gradient});
    }
    ceres::Problem problem;
    problem.AddResidualBlock(new LatticeCost(look, points, std::move(planes), options.smoothness), nullptr,
                             control.data());
    ceres::Solver::Summary summary;
    ceres::Solve(detail::solverOptions(kSteps), &problem, &summary);
  }
  BendLattice result{target.toWorld(low), target.toWorld(high), {}};
  for (std::size_t k = 0; k < result.control.size(); ++k)
    result.control[k] = Vec3d(control[3 * k], control[3 * k + 1], control[3 * k + 2]) * target.size;
  return result;
}

}  // namespace nephele
