// By FFTW, single precision. Plans are estimated, never measured, so that the same box gives the same bits
// every time; they are made one after the other, since FFTW's planner has global state.
#include <fftw3.h>

#include <mutex>

#include "nephele/levelset/flow/detail/fourier_line.h"
#include "nephele/modeling/base/error.h"

namespace nephele::detail {

namespace {

std::mutex& planner() {
  static std::mutex mutex;
  return mutex;
}

fftwf_complex* complexAt(float* values) {
  return reinterpret_cast<fftwf_complex*>(values);
}

}  // namespace

struct FourierLine::Plan {
  Direction direction;
  Layout layout;
  fftwf_plan plan = nullptr;
};

FourierLine::FourierLine(int n, Direction direction, Layout layout)
    : plan_(std::make_unique<Plan>(Plan{direction, layout})) {
  const bool isForward = direction == Direction::forward;
  const AlignedFloats room = alignedFloats(std::size_t(n + 2) * kBlock);
  float* const values = room.get();
  constexpr int kColumns = int(kBlock) / 2;
  const std::lock_guard lock(planner());
  if (layout == Layout::block)
    plan_->plan =
        fftwf_plan_many_dft(1, &n, kColumns, complexAt(values), nullptr, kColumns, 1, complexAt(values),
                            nullptr, kColumns, 1, isForward ? FFTW_FORWARD : FFTW_BACKWARD, FFTW_ESTIMATE);
  else
    plan_->plan = isForward ? fftwf_plan_dft_r2c_1d(n, values, complexAt(values), FFTW_ESTIMATE)
                            : fftwf_plan_dft_c2r_1d(n, complexAt(values), values, FFTW_ESTIMATE);
  require(plan_->plan != nullptr, "projection: there is no transform of this length");
}

FourierLine::FourierLine(FourierLine&&) noexcept = default;

FourierLine::~FourierLine() {
  if (!plan_) return;
  const std::lock_guard lock(planner());
  fftwf_destroy_plan(plan_->plan);
}

void FourierLine::run(float* values) const {
  if (plan_->layout == Layout::block)
    fftwf_execute_dft(plan_->plan, complexAt(values), complexAt(values));
  else if (plan_->direction == Direction::forward)
    fftwf_execute_dft_r2c(plan_->plan, values, complexAt(values));
  else
    fftwf_execute_dft_c2r(plan_->plan, complexAt(values), values);
}

}  // namespace nephele::detail
