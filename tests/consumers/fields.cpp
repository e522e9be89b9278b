// The mathematics alone: no grid, mesh or image library is needed.
#include <nephele/modeling/field/operations.h>
#include <nephele/modeling/shape/shapes.h>

#include <cmath>

int main() {
  const nephele::ScalarField ball = nephele::sphere({0, 0, 0}, 1.0f);
  // Positive inside: one radius from the middle to the surface.
  return std::abs(ball({0, 0, 0}) - 1.0f) < 1e-6f ? 0 : 1;
}
