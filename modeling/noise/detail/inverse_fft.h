#pragma once

#include <complex>
#include <vector>

namespace nephele::detail {

/// The real field of n^3 values, x fastest, that is the sum of waves:
///
///     f(x, y, z) = sum over a, b, c of w(a, b, c) e^(2 pi i (a x + b y + c z) / n)
///
/// A wave and its opposite are conjugates, so half of them is given: w(a, b, c) at
/// [((c mod n) n + b mod n) (n / 2 + 1) + a] for a from 0 to n / 2, and in the planes a = 0 and n / 2 both.
/// `n` is a power of two. `waves` is used up. The same numbers at any thread count.
/// Cost: one inverse FFT on all threads; rows and columns without waves cost next to nothing.
std::vector<float> sumOfWaves(std::vector<std::complex<float>>& waves, int n);

}  // namespace nephele::detail
