#pragma once

#include "nephele/modeling/field/field.h"

/// Where a field is read: the point itself, maps of space, and shapes moved by them.
namespace nephele {

/// The query point: X(x) = x.
VectorField position();
/// The same under the name that maps have: the map that moves nothing.
VectorField identity();

/// f read at X: f(X(x)). The gradient follows by the chain rule.
ScalarField compose(const ScalarField& f, const VectorField& X);
VectorField compose(const VectorField& f, const VectorField& X);
MatrixField compose(const MatrixField& f, const VectorField& X);

/// f moved by `offset`: f(x - offset).
ScalarField translate(const ScalarField& f, const Vec3f& offset);
VectorField translate(const VectorField& f, const Vec3f& offset);
MatrixField translate(const MatrixField& f, const Vec3f& offset);

/// f turned about an axis through the origin, right-handed. Vectors and matrices turn with the field: R
/// v(R^-1 x) and R M(R^-1 x) R^T. @throws Error if the axis is zero.
ScalarField rotate(const ScalarField& f, const Vec3f& axis, float radians);
VectorField rotate(const VectorField& f, const Vec3f& axis, float radians);
MatrixField rotate(const MatrixField& f, const Vec3f& axis, float radians);

/// f enlarged about the origin: f(x / factor). Values stay: for the distance to the enlarged shape multiply
/// by `factor`. @throws Error unless factor > 0 and finite.
ScalarField scale(const ScalarField& f, float factor);
VectorField scale(const VectorField& f, float factor);
MatrixField scale(const MatrixField& f, float factor);

/// f carried along by an affine map: f(map^-1 x). Values stay. @throws Error if the map is singular.
ScalarField transformed(const ScalarField& f, const Affine& map);
VectorField transformed(const VectorField& f, const Affine& map);
MatrixField transformed(const MatrixField& f, const Affine& map);

}  // namespace nephele
