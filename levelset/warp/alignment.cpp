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

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/random_stream.h"

namespace nephele {

namespace {

using Eigen::Matrix3d;

constexpr int kStartPoints = 120, kStartSteps = 8, kRefined = 3, kRefineSteps = 4, kLastSteps = 25;

Vec3d toVec(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
Eigen::Vector3d toEigen(const Vec3d& v) {
  return {v.x, v.y, v.z};
}

/// A shape moved to the origin and scaled to unit size, so that one set of constants fits all.
struct Frame {
  Vec3d centre;
  double size;

  explicit Frame(const ExactDistance& shape) : centre(shape.centre()), size(shape.size()) {}
  Vec3d toLocal(const Vec3d& p) const { return (p - centre) / size; }
  Vec3d toWorld(const Vec3d& p) const { return p * size + centre; }
};

/// Points evenly spread over the surface by area, in the shape's frame: one in each of `count` shares of the
/// area, in the order of the triangles.
std::vector<Vec3d> surfacePoints(const ExactDistance& shape, int count, std::uint32_t seed) {
  const Mesh& mesh = shape.mesh();
  const Frame frame(shape);
  std::vector<double> upTo(mesh.faceCount());
  double area = 0;
  const auto corner = [&](std::size_t t, std::size_t i) {
    return frame.toLocal(mesh.positions[mesh.corners[3 * t + i]]);
  };
  for (std::size_t t = 0; t < upTo.size(); ++t) {
    const Vec3d a = corner(t, 0);
    area += length(cross(corner(t, 1) - a, corner(t, 2) - a));
    upTo[t] = area;
  }
  detail::RandomStream random{seed, std::uint64_t(count)};
  std::vector<Vec3d> points;
  for (int i = 0; i < count; ++i) {
    const double at = (i + random.uniformDouble()) / count * area;
    const auto t = std::size_t(std::lower_bound(upTo.begin(), upTo.end() - 1, at) - upTo.begin());
    const double root = std::sqrt(random.uniformDouble()), second = random.uniformDouble();
    points.push_back(corner(t, 0) * (1 - root) + corner(t, 1) * (root * (1 - second)) +
                     corner(t, 2) * (root * second));
  }
  return points;
}

/// Every k-th point, `count` in all.
std::vector<Vec3d> thinned(const std::vector<Vec3d>& points, int count) {
  std::vector<Vec3d> result;
  for (int i = 0; i < count; ++i)
    result.push_back(points[std::size_t(i) * points.size() / std::size_t(count)]);
  return result;
}

struct Sample {
  double value;
  Vec3d gradient;
};

/// The distance to a shape in its frame.
class Look {
 public:
  virtual ~Look() = default;
  /// `cursor`: of an earlier place of the same point, or of one near it.
  virtual Sample at(const Vec3d& p, ExactDistance::Cursor& cursor) const = 0;
};

class ExactLook final : public Look {
 public:
  explicit ExactLook(const ExactDistance& shape) : shape_(shape), frame_(shape) {}
  Sample at(const Vec3d& p, ExactDistance::Cursor& cursor) const override {
    const ExactDistance::Hit hit = shape_.at(frame_.toWorld(p), cursor);
    return {hit.distance / frame_.size, hit.gradient};
  }

 private:
  const ExactDistance& shape_;
  Frame frame_;
};

/// Samples on a coarse lattice around the shape, found when they are first asked for, interpolated.
class CoarseLook final : public Look {
 public:
  explicit CoarseLook(const ExactDistance& shape)
      : shape_(shape), frame_(shape), values_(kCount * kCount * kCount, kUnknown) {}
  Sample at(const Vec3d& p, ExactDistance::Cursor&) const override {
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
    Sample result{0, {}};
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
  Frame frame_;
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
    const Sample* sample = samples_.data();
    double* row = jacobians ? jacobians[0] : nullptr;
    double slope = 0;
    for (const Vec3d& x : objectPoints_) {
      const Sample& l = *sample++;
      *residuals++ = soften_(l.value, slope);
      if (!row) continue;
      const Vec3d g = l.gradient * slope;
      addTurnDerivative(q, 1, x, g * scale, row);
      row[4] = dot(g, turnBy(q, 1, x)) * scale;
      for (int c = 0; c < 3; ++c) row[5 + c] = g[c];
      row += 8;
    }
    for (const Vec3d& y : referencePoints_) {
      const Sample& l = *sample++;
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
  mutable std::vector<Sample> samples_;
  mutable Parameters at_{};
};

enum class Turning { free, fixed };

struct Fit {
  Parameters parameters;
  /// Root mean square of the softened residuals.
  double cost = 0;
  Turning turning = Turning::free;
};

ceres::Solver::Options solverOptions(int steps) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.max_num_iterations = steps;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  // A share of the cost: where that goes to 0, as between equal shapes, it falls by far more each step.
  options.function_tolerance = 1e-4;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-10;
  return options;
}

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
  ceres::Solve(solverOptions(steps), &problem, &summary);
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

Vec3d Similarity::turned(const Vec3d& v) const {
  return {turn[0] * v.x + turn[1] * v.y + turn[2] * v.z, turn[3] * v.x + turn[4] * v.y + turn[5] * v.z,
          turn[6] * v.x + turn[7] * v.y + turn[8] * v.z};
}

Vec3d Similarity::turnedBack(const Vec3d& v) const {
  return {turn[0] * v.x + turn[3] * v.y + turn[6] * v.z, turn[1] * v.x + turn[4] * v.y + turn[7] * v.z,
          turn[2] * v.x + turn[5] * v.y + turn[8] * v.z};
}

double Similarity::angle() const {
  return std::acos(std::clamp(0.5 * (turn[0] + turn[4] + turn[8] - 1), -1.0, 1.0));
}

AlignmentResult alignSimilarity(const ExactDistance& reference, const ExactDistance& object,
                                const AlignmentOptions& options, const Progress& progress) {
  require(options.pointCount >= kStartPoints,
          fmt::format("alignment: pointCount must be at least {}, got {}", kStartPoints, options.pointCount));
  const std::vector<Vec3d> referencePoints = surfacePoints(reference, options.pointCount, options.seed),
                           objectPoints = surfacePoints(object, options.pointCount, options.seed);
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
  const Frame source(object), target(reference);
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
  LatticeCost(const Look& reference, std::vector<LatticePoint> points, std::vector<PlanePoint> planes,
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
    const Softened soften{kWidth};
    double slope = 0;
    const double perPoint = 1 / std::sqrt(double(points_.size()));
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const LatticePoint& point = points_[i];
      const Sample l = reference_.at(point.from + displacementOf(point.stencil, control), cursors_[i]);
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

  const Look& reference_;
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
  require(options.pointCount >= kStartPoints,
          fmt::format("alignment: pointCount must be at least {}, got {}", kStartPoints, options.pointCount));
  require(options.smoothness > 0 && std::isfinite(options.smoothness),
          fmt::format("alignment: smoothness must be > 0, got {}", options.smoothness));
  const Frame source(object), target(reference);
  const ExactLook look(reference);
  const auto aligned = [&](const Vec3d& p) { return target.toLocal(similarity(p)); };
  // The box of the whole aligned object, in the frame of the reference.
  Vec3d low(1e30, 1e30, 1e30), high = -low;
  for (const std::uint32_t v : object.mesh().corners) {
    const Vec3d p = aligned(object.mesh().positions[v]);
    low = min(low, p);
    high = max(high, p);
  }
  std::vector<LatticePoint> points;
  for (const Vec3d& p : surfacePoints(object, options.pointCount, options.seed)) {
    const Vec3d from = aligned(source.toWorld(p));
    points.push_back({stencilAt(low, high, from), from});
  }
  const std::vector<Vec3d> wanted = surfacePoints(reference, options.pointCount, options.seed);

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
    ceres::Solve(solverOptions(kSteps), &problem, &summary);
  }
  BendLattice result{target.toWorld(low), target.toWorld(high), {}};
  for (std::size_t k = 0; k < result.control.size(); ++k)
    result.control[k] = Vec3d(control[3 * k], control[3 * k + 1], control[3 * k + 2]) * target.size;
  return result;
}

}  // namespace nephele
