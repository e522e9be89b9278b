#pragma once

#include <string>

namespace nephele {

/// How much of the scattered light goes into which direction.
///
/// A share per steradian that depends on c, the cosine between the directions in which light travels before
/// and after, and integrates to 1 over the sphere. Positive parameters scatter forward.
class Phase {
 public:
  /// Isotropic: 1 / (4 pi).
  Phase() = default;
  /// Henyey-Greenstein:  (1 - g^2) / (4 pi (1 + g^2 - 2 g c)^1.5);  mean cosine g.
  /// @throws Error unless -0.99 <= g <= 0.99.
  static Phase henyeyGreenstein(float g);
  /// Schlick's rational form:  (1 - k^2) / (4 pi (1 - k c)^2);  mean cosine (k - (1 - k^2) atanh k) / k^2.
  /// @throws Error unless -0.99 <= k <= 0.99.
  static Phase schlick(float k);
  /// Of particles much smaller than the wavelength:  3 (1 + c^2) / (16 pi);  mean cosine 0.
  static Phase rayleigh();
  /// (1 - mix) Henyey-Greenstein(g1) + mix Henyey-Greenstein(g2). @throws Error unless both lie within
  /// [-0.99, 0.99] and mix within [0, 1].
  static Phase twoLobe(float g1, float g2, float mix);
  /// Draine:  Henyey-Greenstein(g) (1 + alpha c^2) / (1 + alpha (1 + 2 g^2) / 3). B. T. Draine, "Scattering
  /// by interstellar dust grains" (2003). @throws Error unless -0.99 <= g <= 0.99 and 0 <= alpha <= 1000.
  static Phase draine(float g, float alpha);
  /// Water droplets of a diameter in micrometres, without the rainbow, the glory and the colours: a
  /// Henyey-Greenstein peak and a Draine lobe, fitted to 95 % of Mie's exact solution.
  ///
  /// Clouds have 10 to 30, fog from 2 on. J. Jendersie, E. d'Eon, "An Approximate Mie Scattering Function for
  /// Fog and Cloud Rendering" (SIGGRAPH 2023 talks). The fit jumps a little at 0.1, 1.5 and 5 micrometres.
  /// @throws Error unless 0 < diameter <= 50, where the fit ends.
  static Phase mie(float diameterMicrometres);
  /// From one of `forms()`. @throws Error naming the text and what is allowed.
  static Phase parse(const std::string& text);
  /// What `parse` reads, for messages.
  static const char* forms();

  /// Share per steradian at cosine `c` in [-1, 1].
  float operator()(float c) const;
  /// Exact.
  float meanCosine() const;
  /// The same kind, nearer to isotropic: g and k times `factor` in [0, 1], alpha times its square.
  Phase flattened(float factor) const;
  /// A cosine drawn with the density 2 pi phase(c): two uniform numbers in [0, 1] choose the lobe, and the
  /// cosine by inversion of the lobe's cumulative distribution. Rises with `u2`.
  float sampleCosine(float u1, float u2) const;

 private:
  // Henyey-Greenstein and Rayleigh are special cases of Draine.
  struct Lobe {
    float g = 0.0f, alpha = 0.0f;
    bool schlick = false;
    float norm = 0.0795774715f;

    static Lobe draine(float g, float alpha);
    static Lobe rational(float k);
    float value(float c) const;
    float meanCosine() const;
    Lobe flattened(float factor) const;
    float sampleCosine(float u) const;
  };

  Lobe first_, second_;
  float mix_ = 0.0f;  // share of the second
};

}  // namespace nephele
