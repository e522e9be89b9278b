#include "nephele/modeling/cloud/obstacle.h"

#include <limits>
#include <string>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/calculus.h"
#include "nephele/modeling/field/operations.h"

namespace nephele {

VectorField reflected(const VectorField& velocity, const ScalarField& object,
                      const ObstacleOptions& options) {
  require(options.retained >= 0 && options.retained <= 1,
          "reflected: retained must be 0 to 1, got " + numberText(options.retained));
  const VectorField u = memo(velocity), inward = memo(grad(object));
  const ScalarField into = mask(object) * max(dot(u, inward), 0.0f);
  return u - inward * ((1 + options.retained) * into /
                       max(dot(inward, inward), std::numeric_limits<float>::min()));
}

}  // namespace nephele
