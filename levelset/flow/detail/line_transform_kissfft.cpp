// The same by KissFFT, where FFTW must not be used: scalar code, at two to three times the cost.
//
// Sums of cosines and sines are those of exponentials over twice the length, where numbers go on as their
// mirror image. Columns are real then, and two of them pass as one complex column.
#include <kissfft/kiss_fft.h>

#include <algorithm>
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

  std::size_t count() const { return std::size_t(waves == Waves::exponentials ? n : n + 1); }
  /// Sums of cosines and of sines are their own inverse.
  bool isInverse() const { return waves == Waves::exponentials && direction == Direction::inverse; }
  std::size_t length() const { return std::size_t(waves == Waves::exponentials ? n : 2 * n); }

  /// Of one complex column in `from`, of `length()`; the result stands in `to`.
  void transform(std::vector<Complex>& from, std::vector<Complex>& to) const {
    const bool isSine = waves == Waves::sines;
    const auto last = std::size_t(n);
    if (isSine) from[0] = from[last] = {};
    if (waves != Waves::exponentials)
      for (std::size_t i = 1; i < last; ++i) from[2 * last - i] = isSine ? -from[i] : from[i];
    kiss_fft(fft.get(), raw(from.data()), raw(to.data()));
    if (!isSine) return;
    for (std::size_t k = 1; k < last; ++k) to[k] = timesI(to[k]);
    to[0] = to[last] = {};
  }
};

LineTransform::LineTransform(int cells, Waves waves, Direction direction, Layout layout)
    : plan_(std::make_unique<Plan>(Plan{cells, waves, direction, layout})) {
  Plan& p = *plan_;
  p.fft.reset(kiss_fft_alloc(int(p.length()), p.isInverse(), nullptr, nullptr));
  if (!p.fft) throw std::bad_alloc();
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
      for (std::size_t i = 0; i < p.count(); ++i) from[i] = columns[i * kPairs + pair];
      p.transform(from, to);
      for (std::size_t i = 0; i < p.count(); ++i) columns[i * kPairs + pair] = to[i];
    }
    return;
  }
  const bool hasHalf = p.waves == Waves::exponentials;
  auto* const half = reinterpret_cast<Complex*>(values);
  if (hasHalf && !isForward) {
    for (std::size_t k = 0; k <= n / 2; ++k) from[k] = half[k];
    for (std::size_t k = n / 2 + 1; k < n; ++k) from[k] = std::conj(half[n - k]);
  } else {
    std::copy_n(values, p.count(), from.begin());
  }
  p.transform(from, to);
  if (hasHalf && isForward)
    std::copy_n(to.begin(), n / 2 + 1, half);
  else
    for (std::size_t i = 0; i < p.count(); ++i) values[i] = to[i].real();
}

}  // namespace nephele::detail
