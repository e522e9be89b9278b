#pragma once

#include <string>

namespace nephele {

/// How much of the scattered light goes into which direction.
///
/// Henyey-Greenstein:  p(c) = (1 - g^2) / (4 pi (1 + g^2 - 2 g c)^1.5),  c = cosine between the directions in
/// which light travels before and after. g = 0 is isotropic, g > 0 scatters forward. Integrates to 1 over the
/// sphere; mean c = g.
class Phase {
 public:
  /// Isotropic: 1 / (4 pi).
  Phase() = default;
  /// @throws Error unless -0.99 <= g <= 0.99.
  static Phase henyeyGreenstein(float g);
  /// From "isotropic" or "hg:G". @throws Error naming the text and what is allowed.
  static Phase parse(const std::string& text);

  /// Share per steradian at cosine `c` in [-1, 1].
  float operator()(float c) const;
  float meanCosine() const { return g_; }
  /// The same kind with its mean cosine scaled by `factor` in [0, 1].
  Phase flattened(float factor) const;

 private:
  float g_ = 0.0f;
};

}  // namespace nephele
