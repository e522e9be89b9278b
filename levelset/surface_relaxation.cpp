// Relaxation of a map on a surface: triangles get their shape back, and folds open.
//
// The energy is that of Garanzha, Kaporin, Kudryavtseva, Protais, Ray and Sokolov, Foldover-free maps in 50
// lines of code (2021): angles and areas over a barrier chi(det), which is finite for folded triangles and is
// lowered round by round. They minimise it in the plane; here each triangle is seen in the tangent plane of
// the reference at its images, and images go back to the reference's nearest points after each step. Steps
// are Newton's, with each triangle's Hessian freed of its negative directions, solved by CHOLMOD.
//
// Where topology differs, no map is free of folds, and the energy of the triangles that must stay folded
// would rule all others. So a triangle's energy grows with its logarithm only beyond a limit: such triangles
// give up, and a fold shrinks to few of them. A low limit gives up too early where a map without folds
// exists.
//
// Triangles that give up may also tear: a handle that has nowhere to go becomes a row of triangles that span
// the reference, which smears whatever is on it. So sides that span a fifth of the reference resist like
// springs, without a limit, and the jump spreads over as many triangles as it needs. Not from the start:
// images that tear first find the places where they cover the reference, which springs keep them from.
//
// A few smoothing rounds first (Dirichlet energy, implicit Euler) open most folds where the shapes agree;
// many of them shrink to a point what does not wrap around the reference.
//
// Known limits: the minimum is local, and not free of folds for every pair; features that neither shape nor
// size tells apart slide along the surface.
#include "levelset/surface_relaxation.h"

#include <fmt/format.h>

#include <Eigen/CholmodSupport>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "modeling/error.h"
#include "modeling/parallel.h"

namespace nephele {

namespace {

using Eigen::Matrix2d;
using Matrix4 = Eigen::Matrix4d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Vector4 = Eigen::Vector4d;

constexpr std::size_t kGrain = 512;
/// A side resists whose image is longer than this share of the reference and than so many times itself.
constexpr double kTear = 0.2, kGrowth = 3;
/// It is torn at this many times that length.
constexpr double kTorn = 1.5;

/// Unit normals of a reference, smooth across edges.
class SmoothNormals {
 public:
  explicit SmoothNormals(const ExactDistance& reference) : reference_(reference) {
    const Mesh& mesh = reference.mesh();
    const std::vector<std::uint32_t> first = firstEqualPosition(mesh.positions);
    std::vector<Vec3d> sums(mesh.positions.size());
    for (std::size_t t = 0; t < mesh.faceCount(); ++t)
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec3d &p = corner(t, i), u = corner(t, (i + 1) % 3) - p, v = corner(t, (i + 2) % 3) - p;
        sums[first[mesh.corners[3 * t + i]]] +=
            reference.normal(std::uint32_t(t)) * std::atan2(length(cross(u, v)), dot(u, v));
      }
    normals_.resize(sums.size());
    for (std::size_t v = 0; v < sums.size(); ++v) normals_[v] = normalize(sums[first[v]]);
  }
  Vec3d at(const ExactDistance::Hit& hit) const {
    const std::uint32_t* c = reference_.mesh().corners.data() + 3 * std::size_t(hit.triangle);
    const Vec3d sum =
        normals_[c[0]] * hit.weights.x + normals_[c[1]] * hit.weights.y + normals_[c[2]] * hit.weights.z;
    constexpr double kCancelled = 1e-3;
    return length(sum) > kCancelled ? normalize(sum) : reference_.normal(hit.triangle);
  }

 private:
  const Vec3d& corner(std::size_t t, std::size_t i) const {
    return reference_.mesh().positions[reference_.mesh().corners[3 * t + i]];
  }
  const ExactDistance& reference_;
  std::vector<Vec3d> normals_;
};

/// From where on the image of a side resists.
double tearLength(const ExactDistance& reference, double restLength) {
  return std::max(kTear * reference.size(), kGrowth * restLength);
}

/// Two directions that span the plane across `n`.
struct Tangents {
  Vec3d u, v;
  explicit Tangents(const Vec3d& n) {
    const Vec3d other = std::abs(n.x) < 0.6 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
    u = normalize(cross(n, other));
    v = cross(n, u);
    if (u == Vec3d{}) {
      u = {1, 0, 0};
      v = {0, 1, 0};
    }
  }
};

struct Triangle {
  std::array<std::uint32_t, 3> vertex;
  /// Gradients of the corners' weights in the plane of the triangle at rest.
  std::array<Eigen::Vector2d, 3> gradient;
  double area;  ///< Share of the whole.
  /// Of each side, from corner i to the next: 1 / the square of the length from which its image resists.
  std::array<double, 3> perTear;
};

/// Images and what belongs to them.
struct State {
  std::vector<Vec3d> x, normal;
};

/// The energy of a triangle per area, as a function of half = |J|^2 / 2 and d = det J.
struct Energy {
  bool isHarmonic;  ///< `half` alone.
  double epsilon, areaWeight, limit, tearWeight;

  /// chi and its first two derivatives.
  struct Barrier {
    double c, c1, c2;
  };
  Barrier barrier(double d) const {
    const double root = std::sqrt(epsilon * epsilon + d * d);
    // For negative d without cancellation.
    const double c = d >= 0 ? 0.5 * (d + root) : 0.5 * epsilon * epsilon / (root - d);
    return {c, c / root, 0.5 * epsilon * epsilon / (root * root * root)};
  }
  double top(double half, double d) const { return half + 0.5 * areaWeight * (d * d + 1); }
  double value(double half, double d) const {
    return isHarmonic ? half : limit * std::log1p(top(half, d) / barrier(d).c / limit);
  }
  /// Of a side whose square is `s` times that from which it resists.
  double tear(double s) const { return s > 1 ? tearWeight * (s - 1) * (s - 1) : 0.0; }
};

class Relaxation {
 public:
  Relaxation(const ExactDistance& reference, const Mesh& object, std::span<const Vec3d> images)
      : reference_(reference), normals_(reference) {
    const std::vector<std::uint32_t> first = firstEqualPosition(object.positions);
    std::vector<std::uint32_t> index(first.size(), ~0u);
    vertexOf_.resize(first.size());
    for (std::size_t v = 0; v < first.size(); ++v) {
      if (first[v] == v) {
        index[v] = std::uint32_t(state_.x.size());
        state_.x.push_back(images[v]);
      }
      vertexOf_[v] = index[first[v]];
    }
    double area = 0;
    for (std::size_t t = 0; t < object.faceCount(); ++t) area += restShape(object, t, 1).area;
    if (!(area > 0)) return;
    const double scale = std::sqrt(reference.area() / area);
    for (std::size_t t = 0; t < object.faceCount(); ++t) {
      Triangle triangle = restShape(object, t, scale);
      if (!(triangle.area > 0)) continue;
      triangle.area /= reference.area();
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec3d side = object.positions[object.corners[3 * t + (i + 1) % 3]] -
                           object.positions[object.corners[3 * t + i]];
        const double tear = tearLength(reference, scale * length(side));
        triangle.perTear[i] = 1 / (tear * tear);
      }
      for (std::size_t i = 0; i < 3; ++i) triangle.vertex[i] = vertexOf_[object.corners[3 * t + i]];
      triangles_.push_back(triangle);
    }
    project(state_);
    buildPattern();
  }

  void run(const RelaxationOptions& options, const Progress& progress) {
    if (triangles_.empty()) return;
    const int all = options.smoothingRounds + options.rounds;
    const int lowering = std::max(options.rounds / 2, 1), strict = options.rounds * 3 / 4;
    for (int round = 0; round < all; ++round) {
      progress.check();
      progress.advance(double(round) / all);
      const int newton = round - options.smoothingRounds;
      const double lowered = std::pow(kLastEpsilon / kFirstEpsilon, double(newton) / lowering);
      const Energy energy{newton < 0, std::max(kLastEpsilon, kFirstEpsilon * lowered), options.areaWeight,
                          newton < strict ? options.limit : options.lastLimit,
                          newton < options.resistsFrom * options.rounds ? 0 : kTearWeight};
      const double before = total(state_, energy);
      assemble(energy);
      const double after = descend(energy, before);
      if (newton >= strict && before - after < kSettled * before) break;
    }
  }

  std::vector<Vec3d> images() const {
    std::vector<Vec3d> result(vertexOf_.size());
    for (std::size_t v = 0; v < result.size(); ++v) result[v] = state_.x[vertexOf_[v]];
    return result;
  }

 private:
  static constexpr double kFirstEpsilon = 0.5, kLastEpsilon = 0.05;
  static constexpr double kTearWeight = 10;
  /// The last rounds end when one gains less than this share.
  static constexpr double kSettled = 1e-4;
  /// Length of a smoothing step in time, in units of the reference's area.
  static constexpr double kTime = 0.05;
  /// How far a round moves an image at most, in units of the reference.
  static constexpr double kFarthest = 0.1;

  /// Goes along the Newton step, halved until the energy falls; returns the energy.
  double descend(const Energy& energy, double before) {
    const Eigen::VectorXd step = solve();
    constexpr int kHalvings = 8;
    double share = 1;
    for (int half = 0; half < kHalvings; ++half, share *= 0.5) {
      State trial = moveBy(step, share);
      const double after = total(trial, energy);
      if (!(after < before)) continue;
      state_ = std::move(trial);
      return after;
    }
    return before;
  }

  /// A triangle of the object, enlarged; area 0 if it is a sliver, which says nothing about shape.
  static Triangle restShape(const Mesh& object, std::size_t t, double scale) {
    const auto corner = [&](std::size_t i) { return object.positions[object.corners[3 * t + i]]; };
    const Vec3d a = corner(0), e = (corner(1) - a) * scale, f = (corner(2) - a) * scale;
    const Vec3d across = cross(e, f);
    Triangle result{};
    constexpr double kSliver = 1e-6;
    if (!(length(across) > kSliver * std::max({dot(e, e), dot(f, f), dot(e - f, e - f)}))) return result;
    const Vec3d u = normalize(e), v = cross(normalize(across), u);
    Matrix2d edges;
    edges << dot(e, u), dot(f, u), dot(e, v), dot(f, v);
    const Matrix2d inverse = edges.inverse();
    result.gradient[1] = inverse.row(0);
    result.gradient[2] = inverse.row(1);
    result.gradient[0] = -result.gradient[1] - result.gradient[2];
    result.area = 0.5 * length(across);
    return result;
  }

  void project(State& state) const {
    state.normal.resize(state.x.size());
    parallelFor(state.x.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const ExactDistance::Hit hit = reference_.at(state.x[i]);
        state.x[i] = hit.point;
        state.normal[i] = normals_.at(hit);
      }
    });
  }

  Vec3d normalOf(const State& state, const Triangle& t) const {
    return normalize(state.normal[t.vertex[0]] + state.normal[t.vertex[1]] + state.normal[t.vertex[2]]);
  }

  Matrix2d jacobian(const State& state, const Triangle& t) const {
    const Tangents plane(normalOf(state, t));
    Matrix2d j = Matrix2d::Zero();
    const Vec3d& origin = state.x[t.vertex[0]];
    for (std::size_t i = 1; i < 3; ++i) {
      const Vec3d e = state.x[t.vertex[i]] - origin;
      j += Eigen::Vector2d(dot(plane.u, e), dot(plane.v, e)) * t.gradient[i].transpose();
    }
    return j;
  }

  static Vec3d side(const State& state, const Triangle& t, std::size_t i) {
    return state.x[t.vertex[(i + 1) % 3]] - state.x[t.vertex[i]];
  }
  static double tearing(const State& state, const Triangle& t, std::size_t i) {
    const Vec3d e = side(state, t, i);
    return dot(e, e) * t.perTear[i];
  }

  double total(const State& state, const Energy& energy) const {
    // In pieces that do not depend on the number of threads.
    std::vector<double> parts((triangles_.size() + kGrain - 1) / kGrain);
    parallelFor(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        double sum = 0;
        for (std::size_t k = p * kGrain; k < std::min(triangles_.size(), (p + 1) * kGrain); ++k) {
          const Matrix2d j = jacobian(state, triangles_[k]);
          double value = energy.value(0.5 * j.squaredNorm(), j.determinant());
          for (std::size_t i = 0; i < 3; ++i) value += energy.tear(tearing(state, triangles_[k], i));
          sum += triangles_[k].area * value;
        }
        parts[p] = sum;
      }
    });
    return std::accumulate(parts.begin(), parts.end(), 0.0);
  }

  void buildPattern() {
    // Lower triangle of a matrix with 2 x 2 blocks for vertices and edges.
    std::vector<Eigen::Triplet<double>> entries;
    const auto n = 2 * state_.x.size();
    for (std::size_t i = 0; i < n; ++i) entries.emplace_back(int(i), int(i), 0.0);
    for (const Triangle& t : triangles_)
      for (int a = 0; a < 6; ++a)
        for (int b = 0; b <= a; ++b) {
          const auto [row, column] = entryOf(t, a, b);
          entries.emplace_back(row, column, 0.0);
        }
    matrix_.resize(int(n), int(n));
    matrix_.setFromTriplets(entries.begin(), entries.end());
    matrix_.makeCompressed();
    place_.reserve(21 * triangles_.size());
    for (const Triangle& t : triangles_)
      for (int a = 0; a < 6; ++a)
        for (int b = 0; b <= a; ++b) {
          const auto [row, column] = entryOf(t, a, b);
          const int* begin = matrix_.innerIndexPtr() + matrix_.outerIndexPtr()[column];
          const int* end = matrix_.innerIndexPtr() + matrix_.outerIndexPtr()[column + 1];
          place_.push_back(int(std::lower_bound(begin, end, row) - matrix_.innerIndexPtr()));
        }
    solver_.cholmod().print = 0;
    solver_.analyzePattern(matrix_);
  }

  static std::pair<int, int> entryOf(const Triangle& t, int a, int b) {
    const int i = 2 * int(t.vertex[std::size_t(a / 2)]) + a % 2,
              j = 2 * int(t.vertex[std::size_t(b / 2)]) + b % 2;
    return {std::max(i, j), std::min(i, j)};
  }

  /// Gradient and Hessian, the latter without its negative directions.
  void assemble(const Energy& energy) {
    std::vector<std::array<double, 27>> local(triangles_.size());
    parallelFor(triangles_.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) localTerms(triangles_[k], energy, local[k]);
    });
    gradient_ = Eigen::VectorXd::Zero(matrix_.rows());
    double* values = matrix_.valuePtr();
    std::fill_n(values, matrix_.nonZeros(), 0.0);
    std::size_t place = 0;
    for (std::size_t k = 0; k < triangles_.size(); ++k) {
      const Triangle& t = triangles_[k];
      for (std::size_t a = 0; a < 6; ++a) gradient_[2 * t.vertex[a / 2] + a % 2] += local[k][a];
      for (std::size_t e = 0; e < 21; ++e) values[place_[place++]] += local[k][6 + e];
    }
    double trace = 0;
    for (int i = 0; i < matrix_.rows(); ++i) trace += matrix_.valuePtr()[matrix_.outerIndexPtr()[i]];
    const double damping = 1e-6 * trace / double(matrix_.rows());
    for (int i = 0; i < matrix_.rows(); ++i) values[matrix_.outerIndexPtr()[i]] += damping;
    if (!energy.isHarmonic) return;
    // Implicit Euler: the mass of each vertex over the length of the step in time.
    const double perTime = 1 / (kTime * reference_.area());
    for (const Triangle& t : triangles_)
      for (const std::uint32_t v : t.vertex)
        for (std::uint32_t k = 0; k < 2; ++k)
          values[matrix_.outerIndexPtr()[2 * v + k]] += t.area / 3 * perTime;
  }

  /// Gradient and lower half of the Hessian of one triangle by the six coordinates of its corners.
  void localTerms(const Triangle& t, const Energy& energy, std::array<double, 27>& out) const {
    const Tangents plane(normalOf(state_, t));
    const Matrix2d j = jacobian(state_, t);
    // The entries of J are j00, j01, j10, j11; `area` is the derivative of det by them.
    const Vector4 by(j(0, 0), j(0, 1), j(1, 0), j(1, 1)), area(j(1, 1), -j(1, 0), -j(0, 1), j(0, 0));
    Vector4 gradient = by;
    Matrix4 hessian = Matrix4::Identity();
    double share = t.area;
    if (!energy.isHarmonic) {
      const double d = j.determinant(), w = energy.areaWeight, top = energy.top(0.5 * j.squaredNorm(), d);
      const auto [c, c1, c2] = energy.barrier(d);
      const double perC = 1 / c, bySlope = c1 * perC * perC;
      const double slope = w * d * perC - top * bySlope;
      const double bend =
          w * perC - 2 * w * d * bySlope - top * c2 * perC * perC + 2 * top * bySlope * c1 * perC;
      gradient = by * perC + slope * area;
      hessian = Matrix4::Identity() * perC + bend * area * area.transpose() -
                bySlope * (by * area.transpose() + area * by.transpose());
      hessian(0, 3) += slope;
      hessian(3, 0) += slope;
      hessian(1, 2) -= slope;
      hessian(2, 1) -= slope;
      // Without its negative directions, and without the one that the logarithm takes away.
      const Eigen::SelfAdjointEigenSolver<Matrix4> eigen(hessian);
      constexpr double kLeast = 1e-3;
      const Vector4 held = eigen.eigenvalues().cwiseMax(kLeast * std::abs(eigen.eigenvalues()[3]));
      hessian = eigen.eigenvectors() * held.asDiagonal() * eigen.eigenvectors().transpose();
      share /= 1 + top * perC / energy.limit;
    }

    Eigen::Matrix<double, 4, 6> chain;
    for (std::size_t i = 0; i < 3; ++i) {
      const Tangents at(state_.normal[t.vertex[i]]);
      for (int k = 0; k < 2; ++k) {
        const Vec3d& direction = k == 0 ? at.u : at.v;
        const double u = dot(plane.u, direction), v = dot(plane.v, direction);
        chain.col(int(2 * i) + k) << u * t.gradient[i][0], u * t.gradient[i][1], v * t.gradient[i][0],
            v * t.gradient[i][1];
      }
    }
    Vector6 g = share * chain.transpose() * gradient;
    Matrix6 h = share * chain.transpose() * hessian * chain;
    if (energy.tearWeight > 0)
      for (std::size_t i = 0; i < 3; ++i) addTear(t, i, energy, g, h);
    std::size_t next = 0;
    for (int a = 0; a < 6; ++a) out[next++] = g[a];
    for (int a = 0; a < 6; ++a)
      for (int b = 0; b <= a; ++b) out[next++] = h(a, b);
  }

  /// Adds what side `i` resists with; as for all terms, the Hessian without its negative directions.
  void addTear(const Triangle& t, std::size_t i, const Energy& energy, Vector6& gradient,
               Matrix6& hessian) const {
    const double s = tearing(state_, t, i);
    if (!(s > 1)) return;
    const Vec3d e = side(state_, t, i);
    Eigen::Matrix<double, 3, 6> chain = Eigen::Matrix<double, 3, 6>::Zero();
    for (const auto& [corner, sign] : {std::pair{i, -1.0}, std::pair{(i + 1) % 3, 1.0}}) {
      const Tangents at(state_.normal[t.vertex[corner]]);
      for (int k = 0; k < 3; ++k) {
        chain(k, int(2 * corner)) = sign * at.u[k];
        chain(k, int(2 * corner) + 1) = sign * at.v[k];
      }
    }
    const Vector6 bySide = chain.transpose() * Eigen::Vector3d(e.x, e.y, e.z);
    const double weight = t.area * energy.tearWeight, by = t.perTear[i];
    gradient += weight * 4 * (s - 1) * by * bySide;
    hessian +=
        weight * (4 * (s - 1) * by * chain.transpose() * chain + 8 * by * by * bySide * bySide.transpose());
  }

  Eigen::VectorXd solve() {
    solver_.factorize(matrix_);
    if (solver_.info() != Eigen::Success) return -gradient_;
    return solver_.solve(-gradient_);
  }

  State moveBy(const Eigen::VectorXd& step, double alpha) const {
    State trial;
    trial.x.resize(state_.x.size());
    const double most = kFarthest * reference_.size();
    for (std::size_t i = 0; i < trial.x.size(); ++i) {
      const Tangents at(state_.normal[i]);
      Vec3d d = (at.u * step[int(2 * i)] + at.v * step[int(2 * i + 1)]) * alpha;
      const double way = length(d);
      if (way > most) d *= most / way;
      trial.x[i] = state_.x[i] + (isFinite(d) ? d : Vec3d{});
    }
    project(trial);
    return trial;
  }

  const ExactDistance& reference_;
  SmoothNormals normals_;
  std::vector<std::uint32_t> vertexOf_;
  std::vector<Triangle> triangles_;
  State state_;
  Eigen::SparseMatrix<double> matrix_;
  std::vector<int> place_;
  Eigen::VectorXd gradient_;
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver_;
};

}  // namespace

std::size_t countTears(const ExactDistance& reference, const Mesh& object, std::span<const Vec3d> images) {
  require(images.size() == object.positions.size(),
          fmt::format("tears: {} images for {} positions", images.size(), object.positions.size()));
  require(object.isTriangles(), "tears: the object must be triangulated");
  const double area = surfaceArea(object), scale = area > 0 ? std::sqrt(reference.area() / area) : 0;
  std::size_t count = 0;
  for (std::size_t t = 0; t < object.faceCount(); ++t) {
    bool isTorn = false;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = object.corners[3 * t + i], b = object.corners[3 * t + (i + 1) % 3];
      const double rest = scale * length(object.positions[b] - object.positions[a]);
      isTorn |= length(images[b] - images[a]) > kTorn * tearLength(reference, rest);
    }
    count += isTorn;
  }
  return count;
}

std::vector<Vec3d> relaxImages(const ExactDistance& reference, const Mesh& object,
                               std::span<const Vec3d> images, const RelaxationOptions& options,
                               const Progress& progress) {
  require(images.size() == object.positions.size(),
          fmt::format("relaxation: {} images for {} positions", images.size(), object.positions.size()));
  require(
      options.rounds >= 0 && options.smoothingRounds >= 0,
      fmt::format("relaxation: rounds must be >= 0, got {} and {}", options.smoothingRounds, options.rounds));
  require(options.limit > 0 && options.lastLimit > 0,
          fmt::format("relaxation: limits must be > 0, got {} and {}", options.limit, options.lastLimit));
  require(options.areaWeight > 0,
          fmt::format("relaxation: areaWeight must be > 0, got {}", options.areaWeight));
  require(options.resistsFrom >= 0 && options.resistsFrom <= 1,
          fmt::format("relaxation: resistsFrom must be 0 to 1, got {}", options.resistsFrom));
  Relaxation relaxation(reference, object, images);
  relaxation.run(options, progress);
  return relaxation.images();
}

}  // namespace nephele
