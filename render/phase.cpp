#include "render/phase.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "modeling/error.h"
#include "modeling/math.h"

namespace nephele {

Phase Phase::henyeyGreenstein(float g) {
  require(g >= -0.99f && g <= 0.99f, fmt::format("phase: g must be within [-0.99, 0.99], got {}", g));
  Phase phase;
  phase.g_ = g;
  return phase;
}

Phase Phase::parse(const std::string& text) {
  if (text == "isotropic") return {};
  if (text.starts_with("hg:")) {
    float g = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data() + 3, end, g);
    if (error == std::errc() && stop == end) return henyeyGreenstein(g);
  }
  throw Error(fmt::format("phase: expected isotropic or hg:G with G within [-0.99, 0.99], got '{}'", text));
}

float Phase::operator()(float c) const {
  const float s = std::fmax(1.0f + g_ * g_ - 2.0f * g_ * c, 1e-8f);
  return (1.0f - g_ * g_) / (4.0f * kPi * s * std::sqrt(s));
}

Phase Phase::flattened(float factor) const {
  return henyeyGreenstein(g_ * factor);
}

}  // namespace nephele
