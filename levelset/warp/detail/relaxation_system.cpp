// The Newton step of a relaxation: a sparse matrix of 2 x 2 blocks for vertices and edges, of the Hessians of
// triangles, factorised by CHOLMOD.
#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "nephele/levelset/warp/detail/one_thread.h"
#include "nephele/levelset/warp/detail/relaxation.h"
#include "nephele/modeling/base/assertion.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

using Eigen::Matrix2d;
using Matrix4 = Eigen::Matrix4d;
using Vector4 = Eigen::Vector4d;

/// Length of a smoothing step in time, in units of the reference's area.
constexpr double kTime = 0.05;

std::pair<int, int> entryOf(const RelaxedTriangle& t, int a, int b) {
  const int i = 2 * int(t.vertex[std::size_t(a / 2)]) + a % 2,
            j = 2 * int(t.vertex[std::size_t(b / 2)]) + b % 2;
  return {std::max(i, j), std::min(i, j)};
}

}  // namespace

void Relaxation::buildPattern(const Progress& progress) {
  // Lower triangle of a matrix with 2 x 2 blocks for vertices and edges.
  std::vector<Eigen::Triplet<double>> entries;
  const auto n = 2 * isFixed_.size();
  for (std::size_t i = 0; i < n; ++i) entries.emplace_back(int(i), int(i), 0.0);
  for (const RelaxedTriangle& t : triangles_)
    for (int a = 0; a < 6; ++a)
      for (int b = 0; b <= a; ++b) {
        const auto [row, column] = entryOf(t, a, b);
        entries.emplace_back(row, column, 0.0);
      }
  progress.check();
  matrix_.resize(int(n), int(n));
  matrix_.setFromTriplets(entries.begin(), entries.end());
  matrix_.makeCompressed();
  progress.check();
  place_.reserve(21 * triangles_.size());
  for (const RelaxedTriangle& t : triangles_)
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
  progress.check();
  const OneThread oneThread;
  solver_.analyzePattern(matrix_);
}

void Relaxation::assemble(const RelaxationEnergy& energy) {
  NEPHELE_ASSERT(place_.size() == 21 * triangles_.size());
  std::vector<std::array<double, 27>> local(triangles_.size());
  parallelFor(triangles_.size(), kRelaxationGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) localTerms(triangles_[k], energy, local[k]);
  });
  gradient_ = Eigen::VectorXd::Zero(matrix_.rows());
  double* values = matrix_.valuePtr();
  std::fill_n(values, matrix_.nonZeros(), 0.0);
  std::size_t place = 0;
  for (std::size_t k = 0; k < triangles_.size(); ++k) {
    const RelaxedTriangle& t = triangles_[k];
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
  for (const RelaxedTriangle& t : triangles_)
    for (const std::uint32_t v : t.vertex)
      for (std::uint32_t k = 0; k < 2; ++k)
        values[matrix_.outerIndexPtr()[2 * v + k]] += t.area / 3 * perTime;
}

void Relaxation::localTerms(const RelaxedTriangle& t, const RelaxationEnergy& energy,
                            std::array<double, 27>& out) const {
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

void Relaxation::addTear(const RelaxedTriangle& t, std::size_t i, const RelaxationEnergy& energy,
                         Vector6& gradient, Matrix6& hessian) const {
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

Eigen::VectorXd Relaxation::solve() {
  const OneThread oneThread;
  solver_.factorize(matrix_);
  if (solver_.info() != Eigen::Success) return -gradient_;
  return solver_.solve(-gradient_);
}

}  // namespace nephele::detail
