// The same by KissFFT, where FFTW must not be used: scalar code, at two to three times the cost.
//
// Sums of cosines and sines are those of exponentials over twice the length. Columns are real then, and two
// of them pass as one complex column.
#include <kissfft/kiss_fft.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <new>
#include <vector>

#include "nephele/levelset/flow/detail/box_transform.h"

namespace nephele::detail {

namespace {

using Complex = std::complex<float>;

kiss_fft_cpx* raw(Complex* c) {
  return reinterpret_cast<kiss_fft_cpx*>(c);
}

struct FreePlan {
  void operator()(void* plan) const { kiss_fft_free(plan); }
};

Complex timesI(const Complex& c) {
  return {-c.imag(), c.real()};
}

}  // namespace

struct LineTransform::Plan {
  int n;
  Waves waves;
  Direction direction;
  Layout layout;
  /// Tables only: safe to share between threads.
  std::unique_ptr<kiss_fft_state, FreePlan> fft{};
  /// e^(i pi k / (2 n)).
  std::vector<Complex> quarterTurns{};

  std::size_t length() const { return std::size_t(waves == Waves::exponentials ? n : 2 * n); }

  /// Of one complex column in `from`, of `length()`; the result stands in `to`.
  void transform(std::vector<Complex>& from, std::vector<Complex>& to) const {
    const auto count = std::size_t(n);
    const bool isForward = direction == Direction::forward;
    if (waves == Waves::exponentials) {
      kiss_fft(fft.get(), raw(from.data()), raw(to.data()));
      return;
    }
    if (!isForward) {
      // Waves k and -k share a cosine or a sine; 2n - k stands for -k.
      const bool isCosine = waves == Waves::cosines;
      from[count] = {};
      for (std::size_t k = 1; k < count; ++k) {
        const Complex c = isCosine ? from[k] : -timesI(from[k]);
        from[k] = c * quarterTurns[k];
        from[2 * count - k] = (isCosine ? c : -c) * std::conj(quarterTurns[k]);
      }
      if (!isCosine) from[0] = {};
      kiss_fft(fft.get(), raw(from.data()), raw(to.data()));
      return;
    }
    std::fill(from.begin() + n, from.end(), Complex());
    kiss_fft(fft.get(), raw(from.data()), raw(to.data()));
    to[0] = waves == Waves::cosines ? 2.0f * to[0] : Complex();
    for (std::size_t k = 1; k < count; ++k) {
      const Complex a = to[k] * std::conj(quarterTurns[k]), b = to[2 * count - k] * quarterTurns[k];
      to[k] = waves == Waves::cosines ? a + b : timesI(a - b);
    }
  }
};

LineTransform::LineTransform(int n, Waves waves, Direction direction, Layout layout)
    : plan_(std::make_unique<Plan>(Plan{n, waves, direction, layout})) {
  Plan& p = *plan_;
  p.fft.reset(kiss_fft_alloc(int(p.length()), direction == Direction::inverse, nullptr, nullptr));
  if (!p.fft) throw std::bad_alloc();
  for (int k = 0; k < n; ++k) {
    const double angle = 1.5707963267948966 * k / n;
    p.quarterTurns.emplace_back(float(std::cos(angle)), float(std::sin(angle)));
  }
}

LineTransform::LineTransform(LineTransform&&) noexcept = default;
LineTransform::~LineTransform() = default;

void LineTransform::run(float* values) const {
  const Plan& p = *plan_;
  const auto n = std::size_t(p.n);
  const bool isForward = p.direction == Direction::forward;
  std::vector<Complex> from(p.length()), to(from.size());
  if (p.layout == Layout::block) {
    constexpr std::size_t kPairs = kBlock / 2;
    auto* const columns = reinterpret_cast<Complex*>(values);
    for (std::size_t pair = 0; pair < kPairs; ++pair) {
      for (std::size_t i = 0; i < n; ++i) from[i] = columns[i * kPairs + pair];
      p.transform(from, to);
      for (std::size_t i = 0; i < n; ++i) columns[i * kPairs + pair] = to[i];
    }
    return;
  }
  const bool hasHalf = p.waves == Waves::exponentials;
  auto* const half = reinterpret_cast<Complex*>(values);
  if (hasHalf && !isForward) {
    for (std::size_t k = 0; k <= n / 2; ++k) from[k] = half[k];
    for (std::size_t k = n / 2 + 1; k < n; ++k) from[k] = std::conj(half[n - k]);
  } else {
    std::copy_n(values, n, from.begin());
  }
  p.transform(from, to);
  if (hasHalf && isForward)
    std::copy_n(to.begin(), n / 2 + 1, half);
  else
    for (std::size_t i = 0; i < n; ++i) values[i] = to[i].real();
}

}  // namespace nephele::detail
