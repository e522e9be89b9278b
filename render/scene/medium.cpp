#include "nephele/render/scene/medium.h"

#include <fmt/format.h>

#include <cmath>

#include "nephele/modeling/base/error.h"

namespace nephele {

void Medium::check() const {
  require(std::isfinite(extinction) && extinction >= 0,
          fmt::format("extinction: expected a finite number >= 0, got {}", extinction));
  for (int c = 0; c != 3; ++c)
    require(albedo[c] >= 0 && albedo[c] <= 1,
            fmt::format("albedo: expected three numbers within [0, 1], got {}", albedo[c]));
  for (int c = 0; c != 3; ++c)
    require(
        std::isfinite(extinctionColour[c]) && extinctionColour[c] >= 0,
        fmt::format("extinction colour: expected three finite numbers >= 0, got {}", extinctionColour[c]));
}

}  // namespace nephele
