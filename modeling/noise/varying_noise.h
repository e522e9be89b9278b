#pragma once

#include "nephele/modeling/noise/noise.h"

namespace nephele {

/// The greatest frequency of a varying noise may be this many times its least.
inline constexpr float kLargestFrequencyRatio = 256.0f;

/// A noise whose frequency varies in space: features near x are about 1 / frequency(x) wide.
///
///     N(x) = cos(a) N_k(x) + sin(a) N_{k+1}(x),   a = pi/2 t t (3 - 2 t),   f_k r^t = frequency(x)
///
/// where N_k are independent noises of `options` at fixed frequencies f_k = f_0 r^k, a factor r <= sqrt(2)
/// apart, from the least to the greatest value of `frequency`, and f_k is the last that is not above
/// frequency(x). Reading one noise at x frequency(x) instead would shear it, the more the farther from the
/// origin. Mean 0 and unit rms as all noises; the rms gradient follows the frequency within 8 %, as long as
/// that changes little over a feature. Values
/// beyond the bounds of the noise itself, or 3.84 where those are narrower, are cut: fewer than one of 10^4.
/// Where `frequency` is not a number, it reads as its least value.
///
/// A frequency whose range is one value gives `noise` of that frequency, bit for bit. `options.frequency` is
/// without effect; offset and rotation hold for each N_k if given. Ranges of boxes smaller than a cell are
/// tight. Gradient exact. Cost per point: two noises, one where the frequency is one of the f_k, and tens
/// of nanoseconds. A spectral noise is synthesised for every f_k.
/// @throws Error as `noise`, and if the range of `frequency` is not finite, not > 0, or wider than
/// kLargestFrequencyRatio.
ScalarField noiseOfFrequency(const NoiseOptions& options, const ScalarField& frequency);

}  // namespace nephele
