// What glows of a field: steps of the rays that pass it, whatever the density there, and the light in each.
//
// Where there is density its steps are there already and are short enough; what lies between them and may
// glow is filled with steps of no optical depth. The light of a step is asked for in one place, which the
// jitter chooses: the rays of a pixel look in different ones.
#include <algorithm>
#include <cmath>

#include "nephele/render/march/field_march.h"

namespace nephele {

void FieldMarcher::addGlow(std::span<const MarchRay> rays) {
  glowing_.clear();
  for (std::size_t i = 0; i != rays.size(); ++i) fillGlowing(std::uint32_t(i));
  for (std::vector<float>& lane : lanes_) lane.resize(glowing_.size());
  for (std::size_t i = 0; i != glowing_.size(); ++i) {
    const auto [ray, number] = glowing_[i];
    const MarchStep& step = steps_[ray][number];
    const Vec3f place = states_[ray].line.at(step.begin + rays[ray].jitter * step.length);
    for (int axis = 0; axis != 3; ++axis) lanes_[std::size_t(axis)][i] = place[axis];
    ++states_[ray].samples;
  }
  glow_->emission.eval({lanes_[0], lanes_[1], lanes_[2]}, {{lanes_[3], lanes_[4], lanes_[5]}});
  for (std::size_t i = 0; i != glowing_.size(); ++i)
    steps_[glowing_[i].ray][glowing_[i].step].glow =
        FieldGlow::counted({lanes_[3][i], lanes_[4][i], lanes_[5][i]});
}

// Fills the gaps between the steps of a ray where something may glow, and notes all steps that may.
void FieldMarcher::fillGlowing(std::uint32_t ray) {
  const State& state = states_[ray];
  FieldDensity::Walk walk(glow_->bounds, state.line);
  // A run of what may glow, and the part behind it.
  FieldDensity::Span run, next;
  bool hasNext = walk.next(next);
  const auto nextRun = [&] {
    if (!hasNext) return false;
    run = next;
    while ((hasNext = walk.next(next)) && next.begin <= run.end) run.end = next.end;
    return true;
  };
  bool hasRun = nextRun();
  filled_.clear();
  const auto add = [&](const MarchStep& step) {
    glowing_.push_back({ray, std::uint32_t(filled_.size())});
    filled_.push_back(step);
  };
  const auto fill = [&](float begin, float end) {
    while (hasRun && run.begin < end) {
      const float from = std::max(begin, run.begin), length = std::min(end, run.end) - from;
      const int count = int(std::ceil(length / how_.lightLength));
      for (int i = 0; i < count; ++i) {
        const float own = length / float(count), at = from + float(i) * own;
        if (own > leastStep_) add({at, own, 0, at + 0.5f * own});
      }
      if (run.end > end) return;
      hasRun = nextRun();
    }
  };
  float at = 0;
  for (const MarchStep& step : steps_[ray]) {
    fill(at, step.begin);
    at = std::max(at, step.begin + step.length);
    if (hasRun && run.begin < at)
      add(step);
    else
      filled_.push_back(step);
    while (hasRun && run.end <= at) hasRun = nextRun();
  }
  // Behind what hides all else nothing is laid.
  fill(at, state.isDone ? state.line.length : state.cursor);
  steps_[ray].swap(filled_);
}

}  // namespace nephele
