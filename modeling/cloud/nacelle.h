#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "nephele/modeling/field/field.h"

namespace nephele {

/// How far |object(x) - reference(X(x))| is from 0 over many points, in voxels.
struct WarpResidual {
  double median = 0, p95 = 0, p99 = 0, max = 0;
};

struct NacelleOptions {
  /// Iterations at most, 1 to 20.
  int steps = 3;
  /// 1: Newton steps along the gradient of the reference. 2: with its second derivative along it, which pays
  /// where the reference is no distance. For distances, above all gridded ones, 1.
  int order = 1;
  /// Edge of a voxel in world units, the unit of tolerances. Default: the reference's differenceStep().
  std::optional<float> voxel{};
  /// A point is done once its residual is below this share of a voxel.
  float toleranceVoxels = 1e-3f;
  /// Points whose residual stays above this many voxels take the fallback.
  float fallbackVoxels = 0.1f;
  /// X_0, such as an alignment of the object with the reference. Default: x.
  std::optional<VectorField> start{};
  /// The point of the reference's surface nearest to a point of space; turns the fallback on:
  /// X = c + object(x) n with c nearest to X_0 and n the unit gradient of the reference there.
  std::optional<VectorField> closestPoint{};
  /// object(x) is held within these values: above the inradius of the reference there is nothing to map the
  /// inside to, and beyond the band of a gridded reference nothing at all.
  Interval band = Interval::everything();
  /// Puts a field on a grid. Given, g.g and g.M.g (g, M: gradient and Hessian of the reference) are baked
  /// and looked up instead of evaluated: the faster variant of the notes, see docs/nacelle.md for its error.
  std::function<ScalarField(const ScalarField&)> bake{};
};

/// The warp field between two level sets: X with object(x) = reference(X(x)), for any two shapes.
///
/// From X_0, with r = object(x) - reference(X), g the gradient and M the Hessian of the reference at X,
///   Delta = r / g.g,   Gamma = g.M.g / g.g,   A = 2 Delta / (1 + sqrt(1 + 2 Delta Gamma)),   X += A g,
/// Gamma = 0 for order 1 and A = -1 / Gamma where the root has no value. Guarded: |g|^2 counts as at least
/// 1/16, a step is at most 2 |r| / max(|g|, 1/4) long and is halved up to 5 times until |r| falls by a tenth;
/// where |g|^2 < 1e-4 the point stops. Returns the iterate with the smallest |r|, or the fallback. Between
/// distances X is the closest point of the level surface. Never NaN where object, start and closestPoint are
/// finite and a finite point can be given. Range: everything. Gradient: differences. Cost per point: `object`
/// once, the reference's gradient at most steps + 1 times, plus halvings (order 2: three times as often).
/// @throws Error if an option is out of its range.
/// Source: Tessendorf, Resolution Independent Volumes, equations 4.7 to 4.10; the form of A is theirs without
/// its 0/0.
VectorField nacelle(const ScalarField& object, const ScalarField& reference,
                    const NacelleOptions& options = {});

/// What the iterations reach at given points.
struct NacelleStatistics {
  /// Before the first step and after each one; without the fallback.
  std::vector<WarpResidual> iterations;
  /// Of what `nacelle` returns.
  WarpResidual result;
  /// Share of points whose residual stays above options.fallbackVoxels without the fallback.
  double unconvergedFraction = 0;
};

/// The warp field at `points`, written to `images` (three spans as long), and how well it fits there.
/// Uses all cores; the same at any thread count. @throws Error as `nacelle`, and if lengths differ.
NacelleStatistics nacelleAt(const ScalarField& object, const ScalarField& reference, const PointSpans& points,
                            const Spans<3>& images, const NacelleOptions& options = {});

/// Median, 95th and 99th percentile and maximum of |values|, which are put in order. NaN counts as infinite.
WarpResidual residualOf(std::vector<float>& values);

/// A of equation 4.7 for one point, guarded as `nacelle` says but for the halvings: the step is A g.
/// `gg` = g.g, `gMg` = g.M.g; pass 0 for order 1.
template <class T>
T nacelleStep(T r, T gg, T gMg) {
  constexpr T kShortest = T(1) / T(16);
  const T held = gg > kShortest ? gg : kShortest;
  T a = r / held;
  if (gMg != T(0)) {
    const T delta = r / gg, gamma = gMg / gg, root = T(1) + T(2) * delta * gamma;
    // No point of the parabola has the value: go to the one that comes nearest.
    if (root >= T(0))
      a = T(2) * delta / (T(1) + std::sqrt(root));
    else
      a = T(-1) / gamma;
  }
  const T g = std::sqrt(gg), most = T(2) * std::abs(r) / (g > T(0.25) ? g : T(0.25));
  const T way = std::abs(a) * g;
  return way > most ? a * (most / way) : a;
}

}  // namespace nephele
