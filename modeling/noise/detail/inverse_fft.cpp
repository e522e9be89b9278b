// Three passes of one-dimensional transforms by KissFFT, single precision: 1e-7 is far below what a spline
// shows. A spectrum without short waves leaves most lines of the first two passes zero; they are skipped.
#include "nephele/modeling/noise/detail/inverse_fft.h"

#include <kissfft/kiss_fft.h>
#include <kissfft/kiss_fftr.h>

#include <algorithm>
#include <memory>
#include <new>

#include "nephele/modeling/base/assertion.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

using Complex = std::complex<float>;

struct FreePlan {
  void operator()(void* plan) const { kiss_fft_free(plan); }
};

template <class Plan>
std::unique_ptr<Plan, FreePlan> owned(Plan* plan) {
  if (!plan) throw std::bad_alloc();
  return std::unique_ptr<Plan, FreePlan>(plan);
}

kiss_fft_cpx* raw(Complex* c) {
  return reinterpret_cast<kiss_fft_cpx*>(c);
}

/// Lines that are taken out of the array at once: neighbours share cache lines.
constexpr int kTogether = 8;

/// Transforms `count` neighbouring lines of n numbers, `stride` apart.
void transformLines(kiss_fft_cfg plan, Complex* lines, int count, std::size_t stride, int n) {
  std::vector<Complex> from(std::size_t(n) * kTogether), to(from.size());
  for (int start = 0; start < count; start += kTogether) {
    const int here = std::min(kTogether, count - start);
    bool isZero = true;
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < here; ++k) {
        const Complex c = lines[std::size_t(i) * stride + std::size_t(start + k)];
        from[std::size_t(k * n + i)] = c;
        isZero = isZero && c == Complex();
      }
    if (isZero) continue;
    for (int k = 0; k < here; ++k) kiss_fft(plan, raw(from.data() + k * n), raw(to.data() + k * n));
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < here; ++k)
        lines[std::size_t(i) * stride + std::size_t(start + k)] = to[std::size_t(k * n + i)];
  }
}

}  // namespace

std::vector<float> sumOfWaves(std::vector<std::complex<float>>& waves, int n) {
  const int half = n / 2 + 1;
  const std::size_t plane = std::size_t(n) * std::size_t(half);
  NEPHELE_ASSERT(waves.size() == plane * std::size_t(n));
  constexpr int kInverse = 1;
  // Tables only: safe to share between threads.
  const auto plan = owned(kiss_fft_alloc(n, kInverse, nullptr, nullptr));
  parallelFor(std::size_t(n), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y)
      transformLines(plan.get(), waves.data() + y * std::size_t(half), half, plane, n);
  });
  std::vector<float> values(std::size_t(n) * std::size_t(n) * std::size_t(n));
  parallelFor(std::size_t(n), 1, [&](std::size_t begin, std::size_t end) {
    // Has room to work in, which threads cannot share.
    const auto alongX = owned(kiss_fftr_alloc(n, kInverse, nullptr, nullptr));
    for (std::size_t z = begin; z < end; ++z) {
      Complex* const rows = waves.data() + z * plane;
      transformLines(plan.get(), rows, half, std::size_t(half), n);
      for (std::size_t y = 0; y < std::size_t(n); ++y)
        kiss_fftri(alongX.get(), raw(rows + y * std::size_t(half)),
                   values.data() + (z * std::size_t(n) + y) * std::size_t(n));
    }
  });
  waves = {};
  return values;
}

}  // namespace nephele::detail
