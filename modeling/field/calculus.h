#pragma once

#include "nephele/modeling/field/field.h"

/// Derivatives as fields, by world coordinates. First derivatives are exact where the field's gradient is;
/// the gradient of a derivative is made of central differences of it at the field's differenceStep().
namespace nephele {

/// (df/dx, df/dy, df/dz). Points to the inside of shapes.
VectorField grad(const ScalarField& f);
/// The Jacobian: row i holds the gradient of component i.
MatrixField grad(const VectorField& f);
/// dvx/dx + dvy/dy + dvz/dz.
ScalarField div(const VectorField& f);
/// (dvz/dy - dvy/dz, dvx/dz - dvz/dx, dvy/dx - dvx/dy).
VectorField curl(const VectorField& f);

}  // namespace nephele
