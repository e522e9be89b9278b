#pragma once

#include "nephele/modeling/field/field.h"

/// Arithmetic and functions of fields, point by point. A number, vector or matrix stands wherever a field is
/// asked for. Rules for all: gradients are exact (at a kink, those of the branch taken); ranges are
/// conservative; constants fold when the expression is built; results outside a function's domain are NaN or
/// infinite as in <cmath>.
namespace nephele {

// Arithmetic.
ScalarField operator+(const ScalarField& a, const ScalarField& b);
ScalarField operator-(const ScalarField& a, const ScalarField& b);
ScalarField operator*(const ScalarField& a, const ScalarField& b);
ScalarField operator/(const ScalarField& a, const ScalarField& b);
ScalarField operator-(const ScalarField& a);

VectorField operator+(const VectorField& a, const VectorField& b);
VectorField operator-(const VectorField& a, const VectorField& b);
VectorField operator-(const VectorField& a);
VectorField operator*(const VectorField& a, const ScalarField& b);
VectorField operator*(const ScalarField& a, const VectorField& b);
VectorField operator/(const VectorField& a, const ScalarField& b);

MatrixField operator+(const MatrixField& a, const MatrixField& b);
MatrixField operator-(const MatrixField& a, const MatrixField& b);
MatrixField operator-(const MatrixField& a);
MatrixField operator*(const MatrixField& a, const ScalarField& b);
MatrixField operator*(const ScalarField& a, const MatrixField& b);
MatrixField operator/(const MatrixField& a, const ScalarField& b);
/// Matrix product.
MatrixField operator*(const MatrixField& a, const MatrixField& b);
/// Matrix times column vector.
VectorField operator*(const MatrixField& a, const VectorField& b);

// Functions of one scalar.
ScalarField abs(const ScalarField& f);
ScalarField square(const ScalarField& f);
ScalarField sqrt(const ScalarField& f);
ScalarField exp(const ScalarField& f);
/// Natural logarithm.
ScalarField log(const ScalarField& f);
/// Trigonometric functions; arguments and angles in radians.
ScalarField sin(const ScalarField& f);
ScalarField cos(const ScalarField& f);
ScalarField tan(const ScalarField& f);
ScalarField asin(const ScalarField& f);
ScalarField acos(const ScalarField& f);
ScalarField atan(const ScalarField& f);
/// Angle of the point (x, y), from -pi to pi.
ScalarField atan2(const ScalarField& y, const ScalarField& x);
/// Largest whole number that is not above f.
ScalarField floor(const ScalarField& f);
/// base^exponent; 0^0 = 1. Costs several times as much as exp.
ScalarField pow(const ScalarField& base, const ScalarField& exponent);

// Limits and steps.
/// The smaller value. Where one of the two is NaN, the other.
ScalarField min(const ScalarField& a, const ScalarField& b);
/// The larger value. Where one of the two is NaN, the other.
ScalarField max(const ScalarField& a, const ScalarField& b);
/// The larger value with a fillet, which joins shapes smoothly: max(a, b) + (radius - |a - b|)^2 / (4 radius)
/// where |a - b| < radius, else max(a, b). Adds at most radius / 4 (world units, where a and b are
/// distances).
/// @throws Error unless radius > 0 and finite.
ScalarField blend(const ScalarField& a, const ScalarField& b, float radius);
/// f kept inside [low, high]; NaN becomes `low`. @throws Error if low > high or one is NaN.
ScalarField clamp(const ScalarField& f, float low, float high);
/// The same with limits that vary. Where low > high: `high`.
ScalarField clamp(const ScalarField& f, const ScalarField& low, const ScalarField& high);
/// 1 where l > 0, else 0: the inside of a level set (equation 3.1 of the notes).
ScalarField mask(const ScalarField& l);
/// The inside of a level set with an edge of `edgeThickness` world units: 0 outside by more than half of it,
/// 1/2 on the surface, 1 inside by more than half of it, smooth between. Right where l is a distance.
/// @throws Error unless edgeThickness > 0.
ScalarField mask(const ScalarField& l, float edgeThickness);
/// 0 where f <= low, 1 where f >= high, between them t t (3 - 2 t) with t = (f - low) / (high - low).
/// @throws Error unless low < high, both finite.
ScalarField smoothstep(float low, float high, const ScalarField& f);

// Vectors and matrices.
VectorField vectorField(const ScalarField& x, const ScalarField& y, const ScalarField& z);
/// A component of a vector: 0, 1, 2 for x, y, z. @throws Error for any other index.
ScalarField component(const VectorField& v, int index);
/// A row of a matrix. @throws Error unless 0 <= index <= 2.
VectorField row(const MatrixField& m, int index);
/// The matrix with these rows.
MatrixField matrixField(const VectorField& row0, const VectorField& row1, const VectorField& row2);
ScalarField dot(const VectorField& a, const VectorField& b);
VectorField cross(const VectorField& a, const VectorField& b);
ScalarField length(const VectorField& v);
/// v scaled to length 1; zero stays zero.
VectorField normalize(const VectorField& v);
MatrixField transpose(const MatrixField& m);
ScalarField determinant(const MatrixField& m);

/// The same field, evaluated once per block of points however often it occurs in an expression: a shared
/// result is kept for the points it belongs to, with its gradient if that was asked for, also within
/// restricted copies. Worth it for anything dearer than a few operations; costs a copy.
ScalarField memo(const ScalarField& f);
VectorField memo(const VectorField& f);
MatrixField memo(const MatrixField& f);

}  // namespace nephele
