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
// images that tear first find the places where they cover the reference, which springs keep them from. What
// is still torn afterwards is mended: springs that are stronger and begin earlier, on patches whose rims
// stay. Folds that the limit has given up are opened in patches too, with a higher one.
//
// A few smoothing rounds first (Dirichlet energy, implicit Euler) open most folds where the shapes agree;
// many of them shrink to a point what does not wrap around the reference.
//
// Known limits: the minimum is local, and not free of folds for every pair; features that neither shape nor
// size tells apart slide along the surface.
#include "nephele/levelset/warp/surface_relaxation.h"

#include <fmt/format.h>

#include <Eigen/CholmodSupport>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

// Of the OpenMP that CHOLMOD is linked with, if it is.
extern "C" {
int omp_get_max_active_levels() __attribute__((weak));
void omp_set_max_active_levels(int) __attribute__((weak));
}

namespace nephele {

namespace {

/// While it lives, OpenMP regions that this thread enters have one thread: CHOLMOD opens thousands of short
/// ones, which take twice as long on two threads as on one.
class OneThread {
 public:
  OneThread() : before_(isThere() ? omp_get_max_active_levels() : 0) {
    if (isThere()) omp_set_max_active_levels(0);
  }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;
  ~OneThread() {
    if (isThere()) omp_set_max_active_levels(before_);
  }

 private:
  static bool isThere() { return omp_get_max_active_levels && omp_set_max_active_levels; }
  int before_;
};

using Eigen::Matrix2d;
using Matrix4 = Eigen::Matrix4d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Vector4 = Eigen::Vector4d;

constexpr std::size_t kGrain = 512;
/// A side resists whose image is longer than this share of the reference and than so many times itself.
constexpr double kTear = 0.2, kGrowth = 3;

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

/// At what length it is torn: at one and a half times this, or less where triangles are small.
double tornLength(const ExactDistance& reference, double restLength) {
  constexpr double kTorn = 1.5, kLeastTorn = 0.75, kLong = 12;
  const double size = kTear * reference.size();
  return std::max(kTorn * kGrowth * restLength,
                  std::clamp(kLong * restLength, kLeastTorn * size, kTorn * size));
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
  std::uint32_t face;
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

/// Second derivatives of a triangle's energy by the entries of J, by = (j00, j01, j10, j11): with
/// D by = (j11, -j10, -j01, j00) the derivative of det J,
///   identity I + turn D + area (D by) (D by)^T - mixed (by (D by)^T + (D by) by^T).
struct HessianTerms {
  double identity, turn, area, mixed;
};

/// The same without its negative directions, and without the one that the logarithm takes away.
///
/// D has the eigenvalues 1 (rotations times scales) and -1 (reflections), each in a plane. J's parts in the
/// two planes span what the rank-one terms touch: a matrix of 2 x 2. Across them there is an eigenvector in
/// each plane.
Matrix4 heldHessian(const Matrix2d& j, const HessianTerms& terms) {
  constexpr double kHalf = 0.70710678118654752440;
  using Eigen::Vector2d;
  const auto unit = [](const Vector2d& v, double size) {
    return size > 0 ? Vector2d(v / size) : Vector2d(1, 0);
  };
  const Vector2d turned = kHalf * Vector2d(j(0, 0) + j(1, 1), j(0, 1) - j(1, 0)),
                 mirrored = kHalf * Vector2d(j(0, 0) - j(1, 1), j(0, 1) + j(1, 0));
  const double p = turned.norm(), m = mirrored.norm();
  const Vector2d up = unit(turned, p), um = unit(mirrored, m);
  const auto inTurns = [](double a, double b) {
    return Vector4(kHalf * a, kHalf * b, -kHalf * b, kHalf * a);
  };
  const auto inMirrors = [](double a, double b) {
    return Vector4(kHalf * a, kHalf * b, kHalf * b, -kHalf * a);
  };
  const Vector4 alongP = inTurns(up[0], up[1]), acrossP = inTurns(-up[1], up[0]),
                alongM = inMirrors(um[0], um[1]), acrossM = inMirrors(-um[1], um[0]);
  const double plus = terms.identity + terms.turn, minus = terms.identity - terms.turn;
  const double a = plus + (terms.area - 2 * terms.mixed) * p * p, b = -terms.area * p * m,
               c = minus + (terms.area + 2 * terms.mixed) * m * m;
  const double angle = 0.5 * std::atan2(2 * b, a - c), cosine = std::cos(angle), sine = std::sin(angle);
  const double middle = 0.5 * (a + c), radius = std::hypot(0.5 * (a - c), b);
  const std::array<double, 4> values{plus, minus, middle + radius, middle - radius};
  const std::array<Vector4, 4> vectors{acrossP, acrossM, cosine * alongP + sine * alongM,
                                       cosine * alongM - sine * alongP};
  constexpr double kLeast = 1e-3;
  const double least = kLeast * std::abs(*std::max_element(values.begin(), values.end()));
  Matrix4 result = Matrix4::Zero();
  for (std::size_t i = 0; i < 4; ++i)
    result += std::max(values[i], least) * vectors[i] * vectors[i].transpose();
  return result;
}

/// Triangles of the object, and the images of their corners while these are relaxed.
class Relaxation {
 public:
  /// All of the object.
  Relaxation(const ExactDistance& reference, const SmoothNormals& normals, const Mesh& object)
      : Relaxation(reference, normals, object, std::vector<std::uint8_t>(object.positions.size(), 1)) {}
  /// The triangles that have a corner that `moves`; their other corners stay. Coincident positions agree.
  Relaxation(const ExactDistance& reference, const SmoothNormals& normals, const Mesh& object,
             const std::vector<std::uint8_t>& moves)
      : reference_(reference), normals_(normals) {
    const std::vector<std::uint32_t> first = firstEqualPosition(object.positions);
    double area = 0;
    for (std::size_t t = 0; t < object.faceCount(); ++t) area += restShape(object, t, 1).area;
    const double scale = area > 0 ? std::sqrt(reference.area() / area) : 0;
    // Around tears all that is near to tearing resists.
    constexpr double kBeforeTorn = 0.8;
    const bool isLocal = std::find(moves.begin(), moves.end(), 0) != moves.end();
    indexOf_.assign(first.size(), kNone);
    const auto indexOf = [&](std::uint32_t v) {
      std::uint32_t& index = indexOf_[first[v]];
      if (index == kNone) {
        index = std::uint32_t(isFixed_.size());
        isFixed_.push_back(!moves[first[v]]);
      }
      return index;
    };
    for (std::size_t t = 0; t < object.faceCount(); ++t) {
      const std::uint32_t* corner = object.corners.data() + 3 * t;
      if (std::none_of(corner, corner + 3, [&](std::uint32_t v) { return moves[first[v]] != 0; })) continue;
      Triangle triangle = restShape(object, t, scale);
      for (std::size_t i = 0; i < 3; ++i) triangle.vertex[i] = indexOf(corner[i]);
      if (!(triangle.area > 0)) continue;
      triangle.area /= reference.area();
      triangle.face = std::uint32_t(t);
      for (std::size_t i = 0; i < 3; ++i) {
        const double side = length(object.positions[corner[(i + 1) % 3]] - object.positions[corner[i]]);
        const double tear =
            isLocal ? kBeforeTorn * tornLength(reference, scale * side) : tearLength(reference, scale * side);
        triangle.perTear[i] = 1 / (tear * tear);
      }
      triangles_.push_back(triangle);
    }
    for (std::size_t v = 0; v < first.size(); ++v) indexOf_[v] = indexOf_[first[v]];
    if (!triangles_.empty()) buildPattern();
  }

  /// `images` of all positions, the same count as the object's; those that move are replaced.
  void relax(std::span<Vec3d> images, const RelaxationOptions& options, const Progress& progress) {
    place(images);
    run(options, progress);
    for (std::size_t v = 0; v < images.size(); ++v)
      if (indexOf_[v] != kNone && !isFixed_[indexOf_[v]]) images[v] = state_.x[indexOf_[v]];
  }

  /// Faces, of those that have a corner that moves, whose images are turned over or have collapsed.
  std::vector<std::uint32_t> foldedFaces(std::span<const Vec3d> images) {
    constexpr double kLeastArea = 1e-3, kCollapsed = 50;
    place(images);
    std::vector<std::uint32_t> faces;
    for (const Triangle& t : triangles_) {
      const Matrix2d j = jacobian(state_, t);
      const double d = j.determinant();
      if (!(d > kLeastArea && 0.5 * j.squaredNorm() < kCollapsed * d)) faces.push_back(t.face);
    }
    return faces;
  }

 private:
  static constexpr std::uint32_t kNone = ~0u;
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
                          newton < options.resistsFrom * options.rounds ? 0 : options.tearWeight};
      const double before = total(state_, energy);
      assemble(energy);
      const double after = descend(energy, before);
      if (newton >= strict && before - after < kSettled * before) break;
    }
  }

  static constexpr double kFirstEpsilon = 0.5, kLastEpsilon = 0.05;
  /// The last rounds end when one gains less than this share.
  static constexpr double kSettled = 1e-4;
  /// Length of a smoothing step in time, in units of the reference's area.
  static constexpr double kTime = 0.05;
  /// How far a round moves an image at most, in units of the reference.
  static constexpr double kFarthest = 0.1;

  void place(std::span<const Vec3d> images) {
    state_.x.resize(isFixed_.size());
    for (std::size_t v = images.size(); v-- > 0;)
      if (indexOf_[v] != kNone) state_.x[indexOf_[v]] = images[v];
    project(state_);
  }

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
    const auto n = 2 * isFixed_.size();
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
    // Nested dissection halves the work on large meshes; the better of both is taken.
    cholmod_common& settings = solver_.cholmod();
    settings.print = 0;
    settings.nmethods = 2;
    settings.method[0].ordering = CHOLMOD_METIS;
    settings.method[1].ordering = CHOLMOD_AMD;
    const OneThread oneThread;
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
    const double mean = trace / double(matrix_.rows());
    constexpr double kDamping = 1e-6, kHolding = 1e6;
    for (int i = 0; i < matrix_.rows(); ++i) values[matrix_.outerIndexPtr()[i]] += kDamping * mean;
    for (std::size_t v = 0; v < isFixed_.size(); ++v) {
      if (!isFixed_[v]) continue;
      for (const std::size_t i : {2 * v, 2 * v + 1}) {
        gradient_[Eigen::Index(i)] = 0;
        values[matrix_.outerIndexPtr()[i]] += kHolding * mean;
      }
    }
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
      hessian = heldHessian(j, {perC, slope, bend, bySlope});
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
    const OneThread oneThread;
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
      trial.x[i] = state_.x[i] + (isFinite(d) && !isFixed_[i] ? d : Vec3d{});
    }
    project(trial);
    return trial;
  }

  const ExactDistance& reference_;
  const SmoothNormals& normals_;
  /// By position of the object: its place in the state, if it is in there.
  std::vector<std::uint32_t> indexOf_;
  std::vector<std::uint8_t> isFixed_;
  std::vector<Triangle> triangles_;
  State state_;
  Eigen::SparseMatrix<double> matrix_;
  std::vector<int> place_;
  Eigen::VectorXd gradient_;
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver_;
};

/// Which triangles are torn.
std::vector<std::uint8_t> tornTriangles(const ExactDistance& reference, const Mesh& object,
                                        std::span<const Vec3d> images) {
  const double area = surfaceArea(object), scale = area > 0 ? std::sqrt(reference.area() / area) : 0;
  std::vector<std::uint8_t> isTorn(object.faceCount());
  for (std::size_t t = 0; t < isTorn.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = object.corners[3 * t + i], b = object.corners[3 * t + (i + 1) % 3];
      const double rest = scale * length(object.positions[b] - object.positions[a]);
      isTorn[t] |= length(images[b] - images[a]) > tornLength(reference, rest);
    }
  return isTorn;
}

/// The positions within so many triangles of those that are torn, and the part that each is in; coincident
/// ones are one.
struct Patches {
  std::vector<std::uint8_t> moves;
  std::vector<std::uint32_t> part;
};

Patches patchesAround(const Mesh& object, const std::vector<std::uint8_t>& isTorn, int rings) {
  const std::vector<std::uint32_t> first = firstEqualPosition(object.positions);
  Patches result{std::vector<std::uint8_t>(first.size()), std::vector<std::uint32_t>(first.size())};
  std::vector<std::uint8_t>& moves = result.moves;
  for (std::size_t c = 0; c < object.corners.size(); ++c)
    if (isTorn[c / 3]) moves[first[object.corners[c]]] = 1;
  const auto cornersOf = [&](std::size_t t) {
    const std::uint32_t* c = object.corners.data() + 3 * t;
    return std::array<std::uint32_t, 3>{first[c[0]], first[c[1]], first[c[2]]};
  };
  for (int ring = 0; ring < rings; ++ring) {
    const std::vector<std::uint8_t> before = moves;
    for (std::size_t t = 0; t < object.faceCount(); ++t) {
      const auto c = cornersOf(t);
      if (before[c[0]] | before[c[1]] | before[c[2]]) moves[c[0]] = moves[c[1]] = moves[c[2]] = 1;
    }
  }
  // What shares a triangle is one part.
  std::vector<std::uint32_t>& part = result.part;
  std::iota(part.begin(), part.end(), 0u);
  const auto rootOf = [&](std::uint32_t v) {
    while (part[v] != v) v = part[v] = part[part[v]];
    return v;
  };
  for (std::size_t t = 0; t < object.faceCount(); ++t) {
    const auto c = cornersOf(t);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = c[i], b = c[(i + 1) % 3];
      if (!moves[a] || !moves[b]) continue;
      const std::uint32_t low = std::min(rootOf(a), rootOf(b));
      part[rootOf(a)] = part[rootOf(b)] = low;
    }
  }
  for (std::uint32_t v = 0; v < first.size(); ++v) {
    moves[v] = moves[first[v]];
    part[v] = rootOf(first[v]);
  }
  return result;
}

void requireImages(const char* what, const Mesh& object, std::span<const Vec3d> images) {
  require(images.size() == object.positions.size(),
          fmt::format("{}: {} images for {} positions", what, images.size(), object.positions.size()));
  require(object.isTriangles(), fmt::format("{}: the object must be triangulated", what));
}

}  // namespace

std::size_t countTears(const ExactDistance& reference, const Mesh& object, std::span<const Vec3d> images) {
  requireImages("tears", object, images);
  const std::vector<std::uint8_t> isTorn = tornTriangles(reference, object, images);
  return std::size_t(std::count(isTorn.begin(), isTorn.end(), 1));
}

struct SurfaceRelaxation::Parts {
  Parts(const ExactDistance& to, const Mesh& from)
      : reference(to), object(from), normals(to), all(to, normals, from) {}
  const ExactDistance& reference;
  const Mesh& object;
  SmoothNormals normals;
  Relaxation all;
};

SurfaceRelaxation::SurfaceRelaxation(const ExactDistance& reference, const Mesh& object) {
  require(object.isTriangles(), "relaxation: the object must be triangulated");
  parts_ = std::make_unique<Parts>(reference, object);
}
SurfaceRelaxation::~SurfaceRelaxation() = default;

std::vector<Vec3d> SurfaceRelaxation::relaxed(std::span<const Vec3d> images, const RelaxationOptions& options,
                                              const Progress& progress) {
  requireImages("relaxation", parts_->object, images);
  require(
      options.rounds >= 0 && options.smoothingRounds >= 0,
      fmt::format("relaxation: rounds must be >= 0, got {} and {}", options.smoothingRounds, options.rounds));
  require(options.limit > 0 && options.lastLimit > 0,
          fmt::format("relaxation: limits must be > 0, got {} and {}", options.limit, options.lastLimit));
  require(options.areaWeight > 0,
          fmt::format("relaxation: areaWeight must be > 0, got {}", options.areaWeight));
  require(options.resistsFrom >= 0 && options.resistsFrom <= 1,
          fmt::format("relaxation: resistsFrom must be 0 to 1, got {}", options.resistsFrom));
  require(options.tearWeight >= 0,
          fmt::format("relaxation: tearWeight must be >= 0, got {}", options.tearWeight));
  std::vector<Vec3d> result(images.begin(), images.end());
  parts_->all.relax(result, options, progress);
  return result;
}

std::vector<Vec3d> SurfaceRelaxation::mended(std::span<const Vec3d> images, const Progress& progress) {
  requireImages("mending", parts_->object, images);
  const ExactDistance& reference = parts_->reference;
  const Mesh& object = parts_->object;
  const SmoothNormals& normals = parts_->normals;
  std::vector<Vec3d> result(images.begin(), images.end());
  // Sides that resist more, then a limit that gives fewer triangles up; the wider, the less is held.
  struct Try {
    int rings;
    double tearWeight, limit;
  };
  for (const Try& attempt : {Try{4, 40, 5}, Try{4, 400, 5}, Try{10, 100, 5}, Try{10, 1000, 5},
                             Try{20, 1000, 5}, Try{3, 40, 30}, Try{6, 40, 30}, Try{10, 40, 30}}) {
    progress.check();
    const std::vector<std::uint8_t> before = tornTriangles(reference, object, result);
    std::vector<std::uint8_t> isBad = before;
    constexpr double kForTears = 5;
    if (attempt.limit > kForTears)
      for (const std::uint32_t t : parts_->all.foldedFaces(result)) isBad[t] = 1;
    if (std::none_of(isBad.begin(), isBad.end(), [](std::uint8_t bad) { return bad != 0; })) continue;
    const Patches patches = patchesAround(object, isBad, attempt.rings);
    std::vector<Vec3d> trial = result;
    constexpr int kRounds = 12;
    Relaxation local(reference, normals, object, patches.moves);
    local.relax(trial,
                {.smoothingRounds = 0,
                 .rounds = kRounds,
                 .limit = attempt.limit,
                 .lastLimit = attempt.limit,
                 .resistsFrom = 0,
                 .tearWeight = attempt.tearWeight},
                progress);
    // Part by part: torn triangles, and these with those that are turned over.
    std::vector<int> torn(result.size()), bad(result.size());
    const auto partOf = [&](std::size_t t) {
      const std::uint32_t* c = object.corners.data() + 3 * t;
      return patches.part[patches.moves[c[0]] ? c[0] : patches.moves[c[1]] ? c[1] : c[2]];
    };
    const std::vector<std::uint8_t> after = tornTriangles(reference, object, trial);
    for (std::size_t t = 0; t < object.faceCount(); ++t)
      if (before[t] != after[t]) torn[partOf(t)] += int(after[t]) - int(before[t]);
    bad = torn;
    for (const std::uint32_t t : local.foldedFaces(result)) --bad[partOf(t)];
    for (const std::uint32_t t : local.foldedFaces(trial)) ++bad[partOf(t)];
    for (std::size_t v = 0; v < result.size(); ++v) {
      const std::uint32_t part = patches.part[v];
      if (patches.moves[v] && torn[part] <= 0 && bad[part] <= 0 && torn[part] + bad[part] < 0)
        result[v] = trial[v];
    }
  }
  return result;
}

std::vector<Vec3d> relaxImages(const ExactDistance& reference, const Mesh& object,
                               std::span<const Vec3d> images, const RelaxationOptions& options,
                               const Progress& progress) {
  return SurfaceRelaxation(reference, object).relaxed(images, options, progress);
}

}  // namespace nephele
