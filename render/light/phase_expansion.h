#pragma once

#include <vector>

#include "nephele/render/scene/phase.h"

namespace nephele {

/// Legendre's moments of a phase function: p_l = mean of P_l(c) over what is scattered, so that
/// phase(c) = sum over l of (2 l + 1) / (4 pi) p_l P_l(c). The first is 1, the second the mean cosine.
///
/// As many as it takes until squares of what follows are below 1e-5, at most `most`. By Gauss's rule on
/// pieces that are finer towards both ends. Cost: some milliseconds for the sharpest peaks.
std::vector<float> legendreMoments(const Phase& phase, int most = 2000);

/// The same light in a medium without a peak (delta-M, Wiscombe 1977): a share f = p_(degree + 1) of all
/// scattering counts as light that goes on as before.
struct SmoothScattering {
  /// 1 - albedo f: multiplies the extinction.
  float share = 1.0f;
  float albedo = 1.0f;
  /// (p_l - f) / (1 - f) up to the degree; the first is 1.
  std::vector<float> moments{1.0f};

  SmoothScattering() = default;
  SmoothScattering(const std::vector<float>& phaseMoments, float albedo, int degree);
};

/// Light of a beam that has been scattered forward any number of times on its way, and then to the eye.
///
/// At optical depth tau it is, with c the cosine between beam and eye (small-angle approximation, where ways
/// are as long as the beam's):
///
///   F(tau, c) = sum over l of (2 l + 1) / (4 pi) p_l P_l(c) exp(-tau (1 - albedo q_l)),
///
/// q_l = p_l above the degree of a SmoothScattering, f up to it: the rest of these moments is what that
/// solves for. As q runs from 0 to f only, exp(albedo tau q) is interpolated between `count` values of q:
/// F = sum over n of weight(n, c) exp(-tau attenuation(n)). The first is the unscattered beam.
class ForwardLight {
 public:
  static constexpr int kMost = 16;

  /// Light scattered once, by `phase`: what a count of 1 gives.
  explicit ForwardLight(const Phase& phase = {});
  /// @throws Error unless 1 <= count <= 16.
  ForwardLight(const Phase& phase, const std::vector<float>& moments, float albedo, int degree, int count);

  int count() const { return int(attenuations_.size()); }
  float attenuation(int n) const { return attenuations_[std::size_t(n)]; }
  float weight(int n, float cosine) const;
  /// All `count` of them, at most kMost.
  void weights(float cosine, float* found) const;
  /// The sum itself, term by term. Slow; for tests.
  static double exact(const std::vector<float>& moments, float albedo, int degree, float depth, float cosine);

 private:
  static constexpr int kNodes = 1024;

  Phase phase_;
  std::vector<float> attenuations_;
  /// Of every term kNodes + 1 weights, less the phase function for the first, even in the sine of half the
  /// angle.
  std::vector<float> table_;
};

}  // namespace nephele
