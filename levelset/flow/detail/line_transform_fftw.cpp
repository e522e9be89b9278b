// One-dimensional transforms by FFTW, single precision. Plans are estimated, never measured, so that the same
// box gives the same bits every time; they are made one after the other, since FFTW's planner has global
// state.
#include <fftw3.h>

#include <algorithm>
#include <mutex>

#include "nephele/levelset/flow/detail/box_transform.h"
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

struct LineTransform::Plan {
  int n;
  Waves waves;
  Direction direction;
  Layout layout;
  fftwf_plan plan = nullptr;

  std::size_t stride() const { return layout == Layout::row ? 1 : kBlock; }
  /// Numbers that are transformed. Sines have the first and the last to themselves.
  int count() const { return waves == Waves::exponentials ? n : waves == Waves::cosines ? n + 1 : n - 1; }

  fftwf_plan made(float* values) const {
    const bool isForward = direction == Direction::forward;
    constexpr int kSide = int(kBlock), kComplexSide = kSide / 2;
    if (waves == Waves::exponentials && layout == Layout::row)
      return isForward ? fftwf_plan_dft_r2c_1d(n, values, complexAt(values), FFTW_ESTIMATE)
                       : fftwf_plan_dft_c2r_1d(n, complexAt(values), values, FFTW_ESTIMATE);
    if (waves == Waves::exponentials)
      return fftwf_plan_many_dft(1, &n, kComplexSide, complexAt(values), nullptr, kComplexSide, 1,
                                 complexAt(values), nullptr, kComplexSide, 1,
                                 isForward ? FFTW_FORWARD : FFTW_BACKWARD, FFTW_ESTIMATE);
    const fftw_r2r_kind kind = waves == Waves::cosines ? FFTW_REDFT00 : FFTW_RODFT00;
    const int length = count(), columns = int(stride());
    return fftwf_plan_many_r2r(1, &length, columns, values, nullptr, columns, 1, values, nullptr, columns, 1,
                               &kind, FFTW_ESTIMATE);
  }
};

LineTransform::LineTransform(int cells, Waves waves, Direction direction, Layout layout)
    : plan_(std::make_unique<Plan>(Plan{cells, waves, direction, layout})) {
  if (plan_->count() == 0) return;
  const AlignedFloats room = alignedFloats(std::size_t(cells + 2) * kBlock);
  const std::lock_guard lock(planner());
  plan_->plan = plan_->made(room.get() + (waves == Waves::sines ? plan_->stride() : 0));
  require(plan_->plan != nullptr, "projection: there is no transform of this length");
}

LineTransform::LineTransform(LineTransform&&) noexcept = default;

LineTransform::~LineTransform() {
  if (!plan_ || !plan_->plan) return;
  const std::lock_guard lock(planner());
  fftwf_destroy_plan(plan_->plan);
}

void LineTransform::run(float* values) const {
  const Plan& p = *plan_;
  const bool isForward = p.direction == Direction::forward;
  if (p.waves == Waves::exponentials) {
    if (p.layout == Layout::block)
      fftwf_execute_dft(p.plan, complexAt(values), complexAt(values));
    else if (isForward)
      fftwf_execute_dft_r2c(p.plan, values, complexAt(values));
    else
      fftwf_execute_dft_c2r(p.plan, complexAt(values), values);
    return;
  }
  if (p.waves == Waves::cosines) {
    fftwf_execute_r2r(p.plan, values, values);
    return;
  }
  const std::size_t stride = p.stride();
  if (p.plan) fftwf_execute_r2r(p.plan, values + stride, values + stride);
  std::fill_n(values, stride, 0.0f);
  std::fill_n(values + std::size_t(p.n) * stride, stride, 0.0f);
}

}  // namespace nephele::detail
