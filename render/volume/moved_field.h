#pragma once

#include "nephele/modeling/base/box.h"
#include "nephele/modeling/field/field.h"
#include "nephele/render/scene/camera_motion.h"

namespace nephele {

/// How what a field describes moves while a shutter is open.
struct FieldMotion {
  /// World units per frame.
  VectorField velocity;
  Shutter shutter;
  /// Where there is anything, before it moves.
  Box box;
  /// Between the places at which a way is looked at, world units; but it is looked at in 64 at most.
  float spacing;

  /// Where anything comes: as far as the velocity's range says, but no farther than a quarter of the box.
  Box reached() const;
};

/// The mean over the shutter of f(x - velocity(x) t), with 0 outside of the box: as VolumePart::velocity,
/// with a field in place of the grids. Cost: that of f for every place on the way of a point.
ScalarField blurred(const ScalarField& f, const FieldMotion& motion);
VectorField blurred(const VectorField& f, const FieldMotion& motion);

}  // namespace nephele
