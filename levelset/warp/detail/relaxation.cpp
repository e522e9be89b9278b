// Rounds of relaxation: the state of images, its energy, and steps that lower it. The system that gives the
// steps is in relaxation_system.cpp.
#include "nephele/levelset/warp/detail/relaxation.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "nephele/modeling/base/assertion.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

using Eigen::Matrix2d;

/// A side resists whose image is longer than this share of the reference and than so many times itself.
constexpr double kTear = 0.2, kGrowth = 3;

constexpr double kFirstEpsilon = 0.5, kLastEpsilon = 0.05;
/// The last rounds end when one gains less than this share.
constexpr double kSettled = 1e-4;
/// How far a round moves an image at most, in units of the reference.
constexpr double kFarthest = 0.1;

/// From where on the image of a side resists.
double tearLength(const ExactDistance& reference, double restLength) {
  return std::max(kTear * reference.size(), kGrowth * restLength);
}

/// A triangle of the object, enlarged; area 0 if it is a sliver, which says nothing about shape.
RelaxedTriangle restShape(const Mesh& object, std::size_t t, double scale) {
  const auto corner = [&](std::size_t i) { return object.positions[object.corners[3 * t + i]]; };
  const Vec3d a = corner(0), e = (corner(1) - a) * scale, f = (corner(2) - a) * scale;
  const Vec3d across = cross(e, f);
  RelaxedTriangle result{};
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

}  // namespace

double tornLength(const ExactDistance& reference, double restLength) {
  constexpr double kTorn = 1.5, kLeastTorn = 0.75, kLong = 12;
  const double size = kTear * reference.size();
  return std::max(kTorn * kGrowth * restLength,
                  std::clamp(kLong * restLength, kLeastTorn * size, kTorn * size));
}

SmoothNormals::SmoothNormals(const ExactDistance& reference) : reference_(reference) {
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

Vec3d SmoothNormals::at(const ExactDistance::Hit& hit) const {
  const std::uint32_t* c = reference_.mesh().corners.data() + 3 * std::size_t(hit.triangle);
  const Vec3d sum =
      normals_[c[0]] * hit.weights.x + normals_[c[1]] * hit.weights.y + normals_[c[2]] * hit.weights.z;
  constexpr double kCancelled = 1e-3;
  return length(sum) > kCancelled ? normalize(sum) : reference_.normal(hit.triangle);
}

Relaxation::Relaxation(const ExactDistance& reference, const SmoothNormals& normals, const Mesh& object,
                       const std::vector<std::uint8_t>& moves, const Progress& progress)
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
    RelaxedTriangle triangle = restShape(object, t, scale);
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
  if (!triangles_.empty()) buildPattern(progress);
}

void Relaxation::relax(std::span<Vec3d> images, const RelaxationOptions& options, const Progress& progress) {
  NEPHELE_ASSERT(images.size() == indexOf_.size());
  place(images);
  run(options, progress);
  for (std::size_t v = 0; v < images.size(); ++v)
    if (indexOf_[v] != kNone && !isFixed_[indexOf_[v]]) images[v] = state_.x[indexOf_[v]];
}

std::vector<std::uint32_t> Relaxation::foldedFaces(std::span<const Vec3d> images) {
  constexpr double kLeastArea = 1e-3, kCollapsed = 50;
  place(images);
  std::vector<std::uint32_t> faces;
  for (const RelaxedTriangle& t : triangles_) {
    const Matrix2d j = jacobian(state_, t);
    const double d = j.determinant();
    if (!(d > kLeastArea && 0.5 * j.squaredNorm() < kCollapsed * d)) faces.push_back(t.face);
  }
  return faces;
}

void Relaxation::run(const RelaxationOptions& options, const Progress& progress) {
  if (triangles_.empty()) return;
  const int all = options.smoothingRounds + options.rounds;
  const int lowering = std::max(options.rounds / 2, 1), strict = options.rounds * 3 / 4;
  for (int round = 0; round < all; ++round) {
    progress.check();
    progress.advance(double(round) / all);
    const int newton = round - options.smoothingRounds;
    const double lowered = std::pow(kLastEpsilon / kFirstEpsilon, double(newton) / lowering);
    const RelaxationEnergy energy{newton < 0, std::max(kLastEpsilon, kFirstEpsilon * lowered),
                                  options.areaWeight, newton < strict ? options.limit : options.lastLimit,
                                  newton < options.resistsFrom * options.rounds ? 0 : options.tearWeight};
    const double before = total(state_, energy);
    assemble(energy);
    const double after = descend(energy, before);
    if (newton >= strict && before - after < kSettled * before) break;
  }
}

void Relaxation::place(std::span<const Vec3d> images) {
  state_.x.resize(isFixed_.size());
  for (std::size_t v = images.size(); v-- > 0;)
    if (indexOf_[v] != kNone) state_.x[indexOf_[v]] = images[v];
  project(state_);
}

double Relaxation::descend(const RelaxationEnergy& energy, double before) {
  const Eigen::VectorXd step = solve();
  constexpr int kHalvings = 8;
  double share = 1;
  for (int half = 0; half < kHalvings; ++half, share *= 0.5) {
    RelaxationState trial = moveBy(step, share);
    const double after = total(trial, energy);
    if (!(after < before)) continue;
    state_ = std::move(trial);
    return after;
  }
  return before;
}

void Relaxation::project(RelaxationState& state) const {
  state.normal.resize(state.x.size());
  parallelFor(state.x.size(), kRelaxationGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const ExactDistance::Hit hit = reference_.at(state.x[i]);
      state.x[i] = hit.point;
      state.normal[i] = normals_.at(hit);
    }
  });
}

Matrix2d Relaxation::jacobian(const RelaxationState& state, const RelaxedTriangle& t) {
  const Tangents plane(normalOf(state, t));
  Matrix2d j = Matrix2d::Zero();
  const Vec3d& origin = state.x[t.vertex[0]];
  for (std::size_t i = 1; i < 3; ++i) {
    const Vec3d e = state.x[t.vertex[i]] - origin;
    j += Eigen::Vector2d(dot(plane.u, e), dot(plane.v, e)) * t.gradient[i].transpose();
  }
  return j;
}

double Relaxation::total(const RelaxationState& state, const RelaxationEnergy& energy) const {
  // In pieces that do not depend on the number of threads.
  std::vector<double> parts((triangles_.size() + kRelaxationGrain - 1) / kRelaxationGrain);
  parallelFor(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      double sum = 0;
      for (std::size_t k = p * kRelaxationGrain; k < std::min(triangles_.size(), (p + 1) * kRelaxationGrain);
           ++k) {
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

RelaxationState Relaxation::moveBy(const Eigen::VectorXd& step, double alpha) const {
  RelaxationState trial;
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

}  // namespace nephele::detail
