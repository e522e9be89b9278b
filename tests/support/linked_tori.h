#pragma once

#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele::test {

/// The object of figure 4.1 of the notes: two linked tori, a cone through one of them. Fits into a box from
/// (-1.6, -1.2, -1.2) to (1.6, 1.6, 1.2).
inline ScalarField linkedToriAndCone() {
  const ScalarField tori =
      unionOf(torus({.center = {-0.35f, 0, 0}, .axis = {0, 0, 1}, .majorRadius = 0.6f, .minorRadius = 0.18f}),
              torus({.center = {0.35f, 0, 0}, .axis = {0, 1, 0}, .majorRadius = 0.6f, .minorRadius = 0.18f}));
  return unionOf(tori,
                 cone({.apex = {-0.35f, 1.3f, 0}, .baseCenter = {-0.35f, 0.4f, 0}, .baseRadius = 0.35f}));
}

}  // namespace nephele::test
