// By KissFFT, where FFTW must not be used: scalar code, and twice the work for rows.
#include <kissfft/kiss_fft.h>

#include <algorithm>
#include <complex>
#include <new>
#include <vector>

#include "nephele/levelset/flow/detail/fourier_line.h"

namespace nephele::detail {

namespace {

using Complex = std::complex<float>;

kiss_fft_cpx* raw(Complex* c) {
  return reinterpret_cast<kiss_fft_cpx*>(c);
}

struct FreePlan {
  void operator()(void* plan) const { kiss_fft_free(plan); }
};

}  // namespace

struct FourierLine::Plan {
  std::size_t n;
  Direction direction;
  Layout layout;
  /// Tables only: safe to share between threads.
  std::unique_ptr<kiss_fft_state, FreePlan> fft{};
};

FourierLine::FourierLine(int n, Direction direction, Layout layout)
    : plan_(std::make_unique<Plan>(Plan{std::size_t(n), direction, layout})) {
  plan_->fft.reset(kiss_fft_alloc(n, direction == Direction::inverse, nullptr, nullptr));
  if (!plan_->fft) throw std::bad_alloc();
}

FourierLine::FourierLine(FourierLine&&) noexcept = default;
FourierLine::~FourierLine() = default;

void FourierLine::run(float* values) const {
  const std::size_t n = plan_->n;
  const bool isForward = plan_->direction == Direction::forward;
  auto* const numbers = reinterpret_cast<Complex*>(values);
  std::vector<Complex> from(n), to(n);
  const auto transform = [&] { kiss_fft(plan_->fft.get(), raw(from.data()), raw(to.data())); };
  if (plan_->layout == Layout::block) {
    constexpr std::size_t kColumns = kBlock / 2;
    for (std::size_t column = 0; column < kColumns; ++column) {
      for (std::size_t i = 0; i < n; ++i) from[i] = numbers[i * kColumns + column];
      transform();
      for (std::size_t i = 0; i < n; ++i) numbers[i * kColumns + column] = to[i];
    }
  } else if (isForward) {
    std::copy_n(values, n, from.begin());
    transform();
    std::copy_n(to.begin(), n / 2 + 1, numbers);
  } else {
    for (std::size_t k = 0; k <= n / 2; ++k) from[k] = numbers[k];
    for (std::size_t k = n / 2 + 1; k < n; ++k) from[k] = std::conj(numbers[n - k]);
    transform();
    for (std::size_t i = 0; i < n; ++i) values[i] = to[i].real();
  }
}

}  // namespace nephele::detail
