#pragma once

#include <vector>

#include "nephele/modeling/field/field.h"

/// Carrying fields along with a velocity, without any grid: what is at x now was elsewhere before.
///
/// Source: Tessendorf, Resolution Independent Volumes, chapter 7. levelset/flow/advection.h does the same on
/// grids.
namespace nephele {

/// How a step follows the velocity back.
enum class TraceRule {
  /// x - u(x) dt: the step of equation 7.1. Circles become spirals.
  euler,
  /// x - u(x - u(x) dt / 2) dt: errors of second order, at twice the cost.
  midpoint,
};

struct AdvectOptions {
  /// Time of one step; negative runs backwards. Must be finite.
  float dt = 1.0f;
  /// 0 or more.
  int steps = 1;
  TraceRule rule = TraceRule::midpoint;
};

/// The map X from where matter is after `steps` steps to where it was before them: X = T(T(...T(x))), T being
/// one step back. `velocity` is in world units per unit of time.
///
/// The Jacobian is exact where that of the velocity is. Ranges grow by what the velocity can move a box.
/// Cost per point: the velocity once (twice with midpoint) for every step; nothing is stored. Asked within a
/// CancelScope, it ends with any step, by Cancelled.
/// @throws Error if dt is not finite or steps < 0.
VectorField traceBack(const VectorField& velocity, const AdvectOptions& options = {});

/// The same through a velocity that changes: the first step ran with velocities.front(), the last one with
/// velocities.back(). `options.steps` is not used. Source: equation 8.8.
VectorField traceBack(const std::vector<VectorField>& velocities, const AdvectOptions& options = {});

/// `field` carried along: field(X(x)), X = traceBack(velocity, options). Values move and do not thin out
/// where the velocity spreads them. Vectors are carried without being turned. @throws as traceBack.
ScalarField advect(const ScalarField& field, const VectorField& velocity, const AdvectOptions& options = {});
VectorField advect(const VectorField& field, const VectorField& velocity, const AdvectOptions& options = {});

/// One step by MacCormack's scheme: f(X(x)) + (f(x) - f(X(Y(x)))) / 2 with X(x) = x - u(x) dt and Y(x) =
/// x + u(x) dt, so half of what a plain step there and back again loses is given back. Errors of second
/// order.
///
/// Limited to the values of f at X(x) and at the corners of a cube about it, which reaches to each side half
/// a cell of f's grid (half its differenceStep()) and as far as the step there and back again goes astray: no
/// value comes up that f has not. Cost per point: 11 values of `field`, two of `velocity`.
/// @throws Error if dt is not finite.
/// Source: A. Selle and others, An Unconditionally Stable MacCormack Method (2008).
ScalarField macCormack(const ScalarField& field, const VectorField& velocity, float dt);
/// The same, component by component.
VectorField macCormack(const VectorField& field, const VectorField& velocity, float dt);

}  // namespace nephele
