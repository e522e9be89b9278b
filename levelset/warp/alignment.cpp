// Alignment by least squares of distances, with Ceres.
//
// nacelle, like closest-point projection, keeps what is turned or shifted turned or shifted, so the object is
// laid on the reference first. Distances are smooth across surfaces and their gradients are known exactly, so
// Gauss-Newton steps converge in a few rounds from anywhere in the basin, and 28 starts reach one. Far from
// the solution, distances come from a coarse lattice of samples (interpolated, with the exact gradient of the
// interpolant); the last fit uses the meshes themselves.
//
// Object points to the reference alone would shrink the object to a point of its surface. So reference points
// are taken back to the object too, and their distances count in the reference's units: they hold the scale.
//
// Known limits: the basins of shapes with many similar limbs are narrow; a shape and its mirror image are not
// told apart by their distances if both fit; a shape of revolution leaves the turn about its axis as it is.
#include "nephele/levelset/warp/alignment.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "nephele/levelset/warp/detail/alignment_look.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

namespace {

using detail::AlignmentFrame;
using detail::ExactLook;
using detail::kStartPoints;
using detail::Look;
using detail::LookSample;
using detail::Softened;
using Eigen::Matrix3d;

constexpr int kStartSteps = 8, kRefined = 3, kRefineSteps = 4, kLastSteps = 25;

Vec3d toVec(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
Eigen::Vector3d toEigen(const Vec3d& v) {
  return {v.x, v.y, v.z};
}

/// Every k-th point, `count` in all.
std::vector<Vec3d> thinned(const std::vector<Vec3d>& points, int count) {
  std::vector<Vec3d> result;
  for (int i = 0; i < count; ++i)
    result.push_back(points[std::size_t(i) * points.size() / std::size_t(count)]);
  return result;
}

/// Samples on a coarse lattice around the shape, found when they are first asked for, interpolated.
class CoarseLook final : public Look {
 public:
  explicit CoarseLook(const ExactDistance& shape)
      : shape_(shape), frame_(shape), values_(kCount * kCount * kCount, kUnknown) {}
  LookSample at(const Vec3d& p, ExactDistance::Cursor&) const override {
    // Outside the lattice: on from the nearest point of its box.
    constexpr double kInside = kHalf * (1 - 1e-9);
    Vec3d q;
    for (int c = 0; c < 3; ++c) q[c] = std::clamp(p[c], -kInside, kInside);
    Vec3i cell;
    double t[3];
    for (int c = 0; c < 3; ++c) {
      const double u = (q[c] + kHalf) / kSpacing;
      cell[c] = std::min(int(u), kCount - 2);
      t[c] = u - cell[c];
    }
    LookSample result{0, {}};
    for (int k = 0; k < 8; ++k) {
      const int dx = k & 1, dy = k >> 1 & 1, dz = k >> 2;
      const double value = double(valueAt(cell + Vec3i{dx, dy, dz}));
      const double wx = dx ? t[0] : 1 - t[0], wy = dy ? t[1] : 1 - t[1], wz = dz ? t[2] : 1 - t[2];
      result.value += value * wx * wy * wz;
      result.gradient += Vec3d(dx ? wy * wz : -wy * wz, dy ? wx * wz : -wx * wz, dz ? wx * wy : -wx * wy) *
                         (value / kSpacing);
    }
    const Vec3d beyond = p - q;
    if (const double way = length(beyond); way > 0) {
      result.value -= way;
      result.gradient = beyond / -way;
    }
    return result;
  }

 private:
  static constexpr int kCount = 20;
  static constexpr double kHalf = 0.75, kSpacing = 2 * kHalf / (kCount - 1);
  static constexpr float kUnknown = std::numeric_limits<float>::infinity();

  float valueAt(const Vec3i& node) const {
    float& value = values_[std::size_t((node.z * kCount + node.y) * kCount + node.x)];
    if (value == kUnknown) {
      const Vec3d p = Vec3d(node) * kSpacing - Vec3d(kHalf, kHalf, kHalf);
      value = float(shape_.at(frame_.toWorld(p), cursor_).distance / frame_.size);
    }
    return value;
  }

  const ExactDistance& shape_;
  AlignmentFrame frame_;
  // A fit runs on one thread.
  mutable ExactDistance::Cursor cursor_;
  mutable std::vector<float> values_;
};

/// Parameters of a similarity between two frames: unit quaternion (w, x, y, z), log of the scale, shift.
using Parameters = std::array<double, 8>;

Vec3d turnBy(const double* q, double sign, const Vec3d& p) {
  const Vec3d v = Vec3d(q[1], q[2], q[3]) * sign, a = cross(v, p);
  return p + a * (2 * q[0]) + cross(v, a) * 2.0;
}

/// g . d(turned p) / dq, for the quaternion or (sign = -1) its inverse.
void addTurnDerivative(const double* q, double sign, const Vec3d& p, const Vec3d& g, double* derivative) {
  const Vec3d v = Vec3d(q[1], q[2], q[3]) * sign;
  derivative[0] = 2 * dot(g, cross(v, p));
  // d/dv of 2 w v x p + 2 (v (v.p) - p (v.v)).
  const Vec3d byV = cross(p, g) * (2 * q[0]) + (g * dot(v, p) + p * dot(g, v) - v * (2 * dot(g, p))) * 2.0;
  for (int c = 0; c < 3; ++c) derivative[1 + c] = sign * byV[c];
}

/// Residuals of object points in the reference and of reference points in the object.
class SimilarityCost final : public ceres::CostFunction {
 public:
  SimilarityCost(const Look& reference, const Look& object, const std::vector<Vec3d>& objectPoints,
                 const std::vector<Vec3d>& referencePoints, double width)
      : reference_(reference),
        object_(object),
        objectPoints_(objectPoints),
        referencePoints_(referencePoints),
        soften_{width},
        cursors_(objectPoints.size() + referencePoints.size()) {
    set_num_residuals(int(objectPoints.size() + referencePoints.size()));
    mutable_parameter_block_sizes()->push_back(8);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const double* const q = parameters[0];
    const double scale = std::exp(q[4]);
    const Vec3d shift(q[5], q[6], q[7]);
    lookUp(q, scale, shift);
    const LookSample* sample = samples_.data();
    double* row = jacobians ? jacobians[0] : nullptr;
    double slope = 0;
    for (const Vec3d& x : objectPoints_) {
      const LookSample& l = *sample++;
      *residuals++ = soften_(l.value, slope);
      if (!row) continue;
      const Vec3d g = l.gradient * slope;
      addTurnDerivative(q, 1, x, g * scale, row);
      row[4] = dot(g, turnBy(q, 1, x)) * scale;
      for (int c = 0; c < 3; ++c) row[5 + c] = g[c];
      row += 8;
    }
    for (const Vec3d& y : referencePoints_) {
      const LookSample& l = *sample++;
      *residuals++ = soften_(scale * l.value, slope);
      if (!row) continue;
      const Vec3d g = l.gradient * (slope * scale), from = (y - shift) / scale;
      addTurnDerivative(q, -1, from, g, row);
      row[4] = slope * scale * l.value - dot(g, turnBy(q, -1, from));
      const Vec3d byShift = turnBy(q, 1, g) / -scale;
      for (int c = 0; c < 3; ++c) row[5 + c] = byShift[c];
      row += 8;
    }
    return true;
  }

 private:
  /// The solver asks for residuals first and for derivatives at the same place then: samples are kept.
  void lookUp(const double* q, double scale, const Vec3d& shift) const {
    if (!samples_.empty() && std::equal(at_.begin(), at_.end(), q)) return;
    samples_.clear();
    std::size_t next = 0;
    const auto look = [&](const Look& at, const Vec3d& p) {
      ExactDistance::Cursor& cursor = cursors_[next];
      // Points come in the order of triangles.
      if (!cursor.hasPoint && next > 0) cursor = cursors_[next - 1];
      ++next;
      samples_.push_back(at.at(p, cursor));
    };
    for (const Vec3d& x : objectPoints_) look(reference_, turnBy(q, 1, x) * scale + shift);
    for (const Vec3d& y : referencePoints_) look(object_, turnBy(q, -1, (y - shift) / scale));
    std::copy_n(q, at_.size(), at_.begin());
  }

  const Look &reference_, &object_;
  const std::vector<Vec3d>&objectPoints_, &referencePoints_;
  Softened soften_;
  mutable std::vector<ExactDistance::Cursor> cursors_;
  mutable std::vector<LookSample> samples_;
  mutable Parameters at_{};
};

enum class Turning { free, fixed };

struct Fit {
  Parameters parameters;
  /// Root mean square of the softened residuals.
  double cost = 0;
  Turning turning = Turning::free;
};

Fit fitted(const SimilarityCost& cost, Parameters start, int steps, Turning turning = Turning::free) {
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  auto& costs = const_cast<SimilarityCost&>(cost);
  problem.AddResidualBlock(&costs, nullptr, start.data());
  if (turning == Turning::free)
    problem.SetManifold(start.data(),
                        new ceres::ProductManifold<ceres::QuaternionManifold, ceres::EuclideanManifold<4>>());
  else
    problem.SetManifold(start.data(), new ceres::SubsetManifold(8, {0, 1, 2, 3}));
  // Ten times larger or smaller than the moments say is no alignment but a collapse.
  constexpr double kWide = 2.3;
  problem.SetParameterLowerBound(start.data(), 4, start[4] - kWide);
  problem.SetParameterUpperBound(start.data(), 4, start[4] + kWide);
  ceres::Solver::Summary summary;
  ceres::Solve(detail::solverOptions(steps), &problem, &summary);
  return {start, std::sqrt(2 * summary.final_cost / cost.num_residuals()), turning};
}

struct Moments {
  Vec3d mean;
  Matrix3d covariance;
};

Moments momentsOf(const std::vector<Vec3d>& points) {
  Moments result{{}, Matrix3d::Zero()};
  for (const Vec3d& p : points) result.mean += p / double(points.size());
  for (const Vec3d& p : points) {
    const Eigen::Vector3d d = toEigen(p - result.mean);
    result.covariance += d * d.transpose() / double(points.size());
  }
  return result;
}

/// The 24 rotations of a cube, the identity first, and the four that lay main axes on main axes.
std::vector<Matrix3d> startTurns(const Moments& reference, const Moments& object) {
  std::vector<Matrix3d> turns;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3d m = Matrix3d::Zero();
      for (int r = 0; r < 3; ++r) m(r, order[std::size_t(r)]) = signs >> r & 1 ? -1 : 1;
      if (m.determinant() > 0) turns.push_back(m);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  const auto axes = [](const Matrix3d& covariance) {
    Matrix3d m = Eigen::SelfAdjointEigenSolver<Matrix3d>(covariance).eigenvectors();
    if (m.determinant() < 0) m.col(0) = -m.col(0);
    return m;
  };
  const Matrix3d to = axes(reference.covariance), from = axes(object.covariance);
  for (const Eigen::Vector3d& flip : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1, -1, -1),
                                      Eigen::Vector3d(-1, 1, -1), Eigen::Vector3d(-1, -1, 1)})
    turns.push_back(to * flip.asDiagonal() * from.transpose());
  return turns;
}

double angleOf(const Parameters& p) {
  return 2 * std::acos(std::min(std::abs(p[0]), 1.0));
}

/// The order in which fits are preferred: by cost, but among those as good as the best the smallest turn is
/// first.
void rank(std::vector<Fit>& fits, double tolerance) {
  std::stable_sort(fits.begin(), fits.end(), [](const Fit& a, const Fit& b) { return a.cost < b.cost; });
  const double good = fits.front().cost * (1 + tolerance) + 1e-6;
  auto best = fits.begin();
  for (auto f = fits.begin(); f != fits.end() && f->cost <= good; ++f)
    if (angleOf(f->parameters) < angleOf(best->parameters) - 1e-3) best = f;
  std::rotate(fits.begin(), best, best + 1);
}

}  // namespace

AlignmentResult alignSimilarity(const ExactDistance& reference, const ExactDistance& object,
                                const AlignmentOptions& options, const Progress& progress) {
  require(options.pointCount >= kStartPoints,
          fmt::format("alignment: pointCount must be at least {}, got {}", kStartPoints, options.pointCount));
  const std::vector<Vec3d> referencePoints =
                               detail::surfacePoints(reference, options.pointCount, options.seed),
                           objectPoints = detail::surfacePoints(object, options.pointCount, options.seed);
  const Moments to = momentsOf(referencePoints), from = momentsOf(objectPoints);
  const double scale = std::sqrt(to.covariance.trace() / std::max(from.covariance.trace(), 1e-12));

  const std::vector<Vec3d> fewOfReference = thinned(referencePoints, kStartPoints),
                           fewOfObject = thinned(objectPoints, kStartPoints);
  std::vector<Fit> fits;
  {
    const CoarseLook coarseReference(reference), coarseObject(object);
    constexpr double kWide = 0.2;
    const SimilarityCost cost(coarseReference, coarseObject, fewOfObject, fewOfReference, kWide);
    for (const Matrix3d& turn : startTurns(to, from)) {
      progress.check();
      const Eigen::Quaterniond q(turn);
      const Vec3d shift = to.mean - toVec(turn * toEigen(from.mean)) * scale;
      fits.push_back(fitted(cost, {q.w(), q.x(), q.y(), q.z(), std::log(scale), shift.x, shift.y, shift.z},
                            kStartSteps));
    }
  }
  constexpr double kAlike = 0.05;
  rank(fits, kAlike);
  fits.resize(kRefined);
  const ExactLook exactReference(reference), exactObject(object);
  constexpr double kNarrow = 0.05;
  const SimilarityCost few(exactReference, exactObject, fewOfObject, fewOfReference, kNarrow);
  for (Fit& fit : fits) {
    progress.check();
    fit = fitted(few, fit.parameters, kRefineSteps);
  }
  // A turn that gains nothing, as that of a ball, is left out.
  const Vec3d shift = to.mean - from.mean * scale;
  fits.push_back(
      fitted(few, {1, 0, 0, 0, std::log(scale), shift.x, shift.y, shift.z}, kRefineSteps, Turning::fixed));
  rank(fits, kAlike);
  progress.check();
  const SimilarityCost cost(exactReference, exactObject, objectPoints, referencePoints, kNarrow);
  fits.front() = fitted(cost, fits.front().parameters, kLastSteps, fits.front().turning);

  // From frame to frame to world to world.
  const AlignmentFrame source(object), target(reference);
  const Parameters& p = fits.front().parameters;
  AlignmentResult result;
  const Matrix3d turn = Eigen::Quaterniond(p[0], p[1], p[2], p[3]).normalized().toRotationMatrix();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) result.similarity.turn[std::size_t(3 * r + c)] = turn(r, c);
  result.similarity.scale = std::exp(p[4]) * target.size / source.size;
  result.similarity.shift =
      target.toWorld({p[5], p[6], p[7]}) - result.similarity.turned(source.centre) * result.similarity.scale;
  result.cost = fits.front().cost * target.size;
  return result;
}

}  // namespace nephele
