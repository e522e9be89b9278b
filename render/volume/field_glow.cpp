#include "nephele/render/volume/field_glow.h"

#include <algorithm>
#include <limits>

#include "nephele/modeling/field/operations.h"

namespace nephele {

namespace {

ScalarField brightest(const VectorField& emission) {
  const VectorField once = memo(emission);
  return max(max(component(once, 0), component(once, 1)), component(once, 2));
}

}  // namespace

FieldGlow::FieldGlow(const VectorField& itsEmission, const Box& box, float cell, const Progress& progress)
    : emission(itsEmission), bounds(brightest(itsEmission), box, cell, progress, false) {}

Vec3f FieldGlow::counted(const Vec3f& value) {
  Vec3f result;
  for (int c = 0; c != 3; ++c)
    result[c] = value[c] > 0 ? std::min(value[c], FieldDensity::kMostDensity) : 0.0f;
  return result;
}

GlowingWalk::GlowingWalk(const FieldDensity& density, const FieldGlow* glow, const FieldDensity::Line& line)
    : density_(density, line) {
  if (glow) glow_.emplace(glow->bounds, line);
  hasDense_ = density_.next(dense_);
  hasGlowing_ = glow_ && glow_->next(glowing_);
}

bool GlowingWalk::next(Span& span) {
  for (;;) {
    while (hasDense_ && dense_.end <= at_) hasDense_ = density_.next(dense_);
    while (hasGlowing_ && glowing_.end <= at_) hasGlowing_ = glow_->next(glowing_);
    if (!hasDense_ && !hasGlowing_) return false;
    constexpr float kNever = std::numeric_limits<float>::infinity();
    const float dense = hasDense_ ? std::max(dense_.begin, at_) : kNever,
                glowing = hasGlowing_ ? std::max(glowing_.begin, at_) : kNever;
    const float begin = std::min(dense, glowing);
    const bool isDense = dense <= begin, glows = glowing <= begin;
    span = {};
    if (isDense) static_cast<FieldDensity::Span&>(span) = dense_;
    span.glows = glows;
    span.begin = begin;
    span.end = at_ = std::min(isDense ? dense_.end : dense, glows ? glowing_.end : glowing);
    if (span.end > span.begin) return true;
  }
}

}  // namespace nephele
