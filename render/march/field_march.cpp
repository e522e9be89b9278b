// Marching a field.
//
// Rays are taken a window of steps at a time, so that those that meet something opaque stop there, and all
// rays of a window are asked for together, level of halving by level: the field sees long blocks of points
// however few steps a ray has left to refine.
//
// The test compares the trapezoid rule over a step with that over its halves. A sharp edge that happens to
// pass through all three samples on a straight line would escape, hence a half inherits an eighth of its
// whole's doubt, which is what a smooth density leaves of it anyway.
//
// The light varies over voxels of its lattice and not over edges of the density, so steps are put together
// again before the light is read: opacities stay exact, since optical depths just add up.
//
// Limits: what is narrower than a step and missed by all its samples is seen only by other rays.
#include "nephele/render/march/field_march.h"

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"

namespace nephele {

namespace {

// Steps laid before a ray's opacity is looked at.
constexpr int kWindow = 16;
// Share of the threshold that bounds may be off by, over one span.
constexpr float kSettled = 1.0f / 16;
// Share of its doubt that a step leaves to its halves.
constexpr float kInherited = 1.0f / 8;
// How much longer steps are where the density is not likely to vary.
constexpr float kFlat = 4;
// Steps for the light whose length is not worked out anew.
constexpr int kSimilar = 4;
// No closer than this share of the longest step, however narrow pixels are near the eye; nor than this share
// of the box, which is about what floats can tell apart.
constexpr float kClosest = 1.0f / 64;
constexpr float kLeast = 1e-6f;
// As opaque as a step can be.
constexpr float kDeepest = 1e4f;

}  // namespace

void FieldMarcher::march(const MarchScene& scene, std::span<const MarchRay> rays,
                         std::span<MarchResult> results, std::span<MarchRecord> records) {
  extinction_ = scene.extinction;
  cutoff_ = scene.cutoff;
  hidden_ = -std::log(scene.cutoff) / scene.leastColour();
  leastStep_ = kLeast * density_.box().longestSide();
  leastLight_ = std::max(scene.leastStep, leastStep_);
  leastColour_ = scene.leastColour();
  growth_ = scene.mostGrowth;
  states_.clear();
  live_.clear();
  if (steps_.size() < rays.size()) steps_.resize(rays.size());
  const auto detail = how_.halvings > 0 ? FieldDensity::Detail::cells : FieldDensity::Detail::bricks;
  for (std::size_t i = 0; i != rays.size(); ++i) {
    const FieldDensity::Line line{rays[i].world.origin, rays[i].world.direction, rays[i].length};
    states_.push_back({line, FieldDensity::Walk(density_, line, detail)});
    states_.back().lightDepth = how_.lightDepth;
    steps_[i].clear();
    live_.push_back(std::uint32_t(i));
  }
  while (!live_.empty()) {
    pieces_.clear();
    batch_.clear();
    for (const std::uint32_t ray : live_) addWindow(ray, rays[ray]);
    firstCount_ = pieces_.size();
    answerFirst();
    refine();
    emit();
    std::erase_if(live_, [&](std::uint32_t ray) {
      State& state = states_[ray];
      const bool isHidden =
          rays[ray].holdout.transmittance((rays[ray].start + state.cursor) * rays[ray].cosine,
                                          state.holdoutCursor) <= cutoff_;
      const bool isFinished = state.isDone || isHidden || state.opticalDepth >= hidden_;
      if (isFinished) closeLight(ray);
      return isFinished;
    });
  }
  if (colour_ && scene.hasStepColours) askColours(rays);
  if (glow_ && scene.hasStepGlow) addGlow(rays);
  spans_.assign(steps_.begin(), steps_.begin() + std::ptrdiff_t(rays.size()));
  marchSteps(scene, rays, spans_, results, records);
  for (std::size_t i = 0; i != rays.size(); ++i) results[i].samples = states_[i].samples;
}

// All rays together; what is no number counts as 0.
void FieldMarcher::askColours(std::span<const MarchRay> rays) {
  std::size_t count = 0;
  for (std::size_t i = 0; i != rays.size(); ++i) count += steps_[i].size();
  for (std::vector<float>& lane : lanes_) lane.resize(count);
  std::size_t next = 0;
  for (std::size_t i = 0; i != rays.size(); ++i)
    for (const MarchStep& step : steps_[i]) {
      const Vec3f place = states_[i].line.at(step.place);
      for (int axis = 0; axis != 3; ++axis) lanes_[std::size_t(axis)][next] = place[axis];
      ++next;
    }
  colour_->eval({lanes_[0], lanes_[1], lanes_[2]}, {{lanes_[3], lanes_[4], lanes_[5]}});
  next = 0;
  for (std::size_t i = 0; i != rays.size(); ++i)
    for (MarchStep& step : steps_[i]) {
      for (int c = 0; c != 3; ++c) {
        const float value = lanes_[std::size_t(3 + c)][next];
        step.colour[c] = value > 0 ? std::min(value, 1.0f) : 0.0f;
      }
      ++next;
    }
}

// Lays the next steps of a ray.
void FieldMarcher::addWindow(std::uint32_t index, const MarchRay& ray) {
  State& state = states_[index];
  const float seen = std::exp(-leastColour_ * state.opticalDepth);
  // What the bounds leave no doubt about.
  float promised = state.opticalDepth;
  int count = 0;
  // Of a whole step, which has a sample in its middle.
  const float widest = 0.5f * density_.cell(), narrowest = density_.cell() / 16;
  const auto lengthAt = [&](float s) {
    const float pixel = how_.pixelWidth + how_.pixelAngle * (ray.start + s);
    float between = std::clamp(pixel, kClosest * how_.longest, how_.longest);
    // Corners of cells do not vouch for what is much smaller than they are.
    if (state.isFlat && between >= narrowest) between = std::max(between, std::min(kFlat * between, widest));
    return 2 * std::max(between, leastStep_);
  };
  const auto lay = [&](float end) {
    Piece piece{index, state.cursor >= state.regionBegin ? state.region : FieldDensity::kAnyRegion,
                state.cursor, end};
    piece.first = state.lastDensity;
    piece.follows = state.isStarted;
    if (!piece.follows) ask(piece, piece.begin);
    ask(piece, 0.5f * (piece.begin + piece.end));
    ask(piece, piece.end);
    pieces_.push_back(piece);
    state.isStarted = true;
    state.cursor = end;
    ++count;
  };
  const auto endRun = [&] {
    if (state.isRunning && state.cursor < state.runEnd) lay(state.runEnd);
    state.isRunning = state.isStarted = false;
  };
  while (count < kWindow && promised < hidden_) {
    if (state.isRunning) {
      const float length = lengthAt(state.cursor);
      const float end = state.cursor + (state.isFresh ? length * ray.jitter : length);
      if (end <= state.runEnd) {
        state.isFresh = false;
        if (end > state.cursor) lay(end);
        continue;
      }
    }
    FieldDensity::Span span;
    if (!state.walk.next(span)) {
      endRun();
      state.isDone = true;
      return;
    }
    promised += extinction_ * span.range.min * (span.end - span.begin);
    const float spread = (span.range.max - span.range.min) * 0.5f * extinction_ * (span.end - span.begin);
    if (span.range.isPoint() || (how_.halvings > 0 && seen * spread <= kSettled * how_.threshold)) {
      endRun();
      const float density = 0.5f * (span.range.min + span.range.max);
      Piece* before = pieces_.empty() ? nullptr : &pieces_.back();
      if (before && before->ray == index && !before->isOpen && before->middle == density &&
          before->end == span.begin) {
        before->end = span.end;
      } else {
        Piece& piece = pieces_.emplace_back(Piece{index, span.region, span.begin, span.end});
        piece.first = piece.middle = piece.last = density;
        piece.isOpen = false;
        ++count;
      }
      state.cursor = span.end;
      continue;
    }
    if (state.isRunning && span.begin > state.runEnd) endRun();
    if (state.isRunning && span.isFlat != state.isFlat && state.cursor < state.runEnd) lay(state.runEnd);
    state.isFlat = span.isFlat;
    if (!state.isRunning) {
      state.isRunning = state.isFresh = true;
      state.cursor = state.regionBegin = span.begin;
      state.region = span.region;
    }
    if (span.region != state.region) {
      state.region = span.region;
      state.regionBegin = span.begin;
    }
    state.runEnd = span.end;
  }
}

void FieldMarcher::ask(const Piece& piece, float s) {
  State& state = states_[piece.ray];
  batch_.add(density_, state.line, s, piece.region);
  ++state.samples;
}

float FieldMarcher::depthOf(const Piece& p) const {
  return std::min(extinction_ * (p.end - p.begin) * (p.first + 4 * p.middle + p.last) * (1.0f / 6), kDeepest);
}

// Gives a window's steps their densities, and the optical depth in front of them.
void FieldMarcher::answerFirst() {
  const float* value = batch_.eval(density_).data();
  std::uint32_t ray = ~0u;
  float depth = 0, last = 0;
  for (Piece& p : pieces_) {
    if (p.ray != ray) {
      ray = p.ray;
      depth = states_[ray].opticalDepth;
      last = states_[ray].lastDensity;
    }
    if (p.isOpen) {
      p.first = p.follows ? last : *value++;
      p.middle = *value++;
      p.last = *value++;
    }
    last = p.last;
    p.depthBefore = depth;
    depth += depthOf(p);
  }
}

// Halves steps, and their halves.
void FieldMarcher::refine() {
  std::size_t begin = 0;
  for (int level = 0; level != how_.halvings; ++level) {
    const std::size_t end = pieces_.size();
    batch_.clear();
    for (std::size_t i = begin; i != end; ++i)
      if (pieces_[i].isOpen) halve(i);
    if (pieces_.size() == end) return;
    const std::span<const float> values = batch_.eval(density_);
    for (std::size_t i = 0; i != values.size(); ++i) pieces_[end + i].middle = values[i];
    begin = end;
  }
}

// Halves a step if it needs that, and asks for the middles of its halves.
void FieldMarcher::halve(std::size_t index) {
  Piece& p = pieces_[index];
  const float off = extinction_ * (p.end - p.begin) * 0.25f * std::fabs(2 * p.middle - p.first - p.last);
  p.doubt = std::max(off, kInherited * p.doubt);
  if (!(p.doubt > how_.threshold) ||
      !(std::exp(-leastColour_ * p.depthBefore) * std::min(p.doubt, 1.0f) > how_.threshold))
    return;
  p.halves = std::uint32_t(pieces_.size());
  const float middle = 0.5f * (p.begin + p.end);
  Piece near = p, far = p;
  near.end = far.begin = middle;
  near.last = far.first = p.middle;
  far.depthBefore += 0.25f * extinction_ * (p.end - p.begin) * (p.first + p.middle);
  for (Piece* half : {&near, &far}) {
    half->halves = 0;
    ask(*half, 0.5f * (half->begin + half->end));
  }
  pieces_.push_back(near);
  pieces_.push_back(far);
}

// Gives the steps of a window, as they now are, to the light.
void FieldMarcher::emit() {
  for (std::size_t i = 0; i != firstCount_; ++i) {
    emitPiece(i);
    states_[pieces_[i].ray].lastDensity = pieces_[i].last;
  }
}

void FieldMarcher::emitPiece(std::size_t index) {
  const Piece& p = pieces_[index];
  if (p.halves) {
    emitPiece(p.halves);
    emitPiece(p.halves + 1);
    return;
  }
  const float all = p.first + 2 * p.middle + p.last;
  if (!(all > 0)) {
    closeLight(p.ray);
    return;
  }
  const float middle = 0.5f * (p.begin + p.end), depth = depthOf(p), share = depth / all;
  emitHalf(p.ray, p.begin, middle, p.first, p.middle, share);
  emitHalf(p.ray, middle, p.end, p.middle, p.last, share);
  states_[p.ray].opticalDepth += depth;
}

// A straight density between two places, which adds `share` of the sum of both ends.
void FieldMarcher::emitHalf(std::uint32_t ray, float begin, float end, float first, float last, float share) {
  State& state = states_[ray];
  const float depth = share * (first + last);
  MarchStep& light = state.light;
  if (!(depth > 0)) {
    closeLight(ray);
    return;
  }
  const float longest = first == last ? how_.uniformLength : how_.lightLength;
  if (how_.halvings == 0 || light.opticalDepth + depth > state.lightDepth || end - light.begin > longest ||
      begin != state.lightEnd)
    closeLight(ray);
  // The middle of what is added between two places.
  const auto centre = [](float from, float to, float near, float far) {
    return from + (to - from) * (near + 2 * far) / (3 * (near + far));
  };
  const float length = end - begin;
  if (depth <= state.lightDepth && length <= longest) {
    if (light.opticalDepth == 0) light = {begin, 0, 0, 0};
    light.length = end - light.begin;
    light.opticalDepth += depth;
    light.place += depth * centre(begin, end, first, last);
    state.lightEnd = end;
    return;
  }
  closeLight(ray);
  // Not from the depth, as the least densities times a length are 0.
  const float perDensity = 2 * share / length, slope = (last - first) / length;
  float at = begin, near = first;
  while (at < end && state.lit < hidden_) {
    const float left = end - at, thickest = perDensity * std::max(near, last);
    const float wanted = std::max(std::min(state.lightDepth / thickest, longest), leastLight_);
    const int count = int(std::ceil(left / wanted));
    const float step = left / float(count);
    // A few of them are hidden about as much.
    for (int i = 0; i != std::min(count, kSimilar); ++i) {
      const bool isLast = i + 1 == count;
      const float to = isLast ? end : at + step, far = isLast ? last : near + slope * step;
      const float own = perDensity * 0.5f * (near + far) * (to - at);
      addLight(state, {at, to - at, own, near == far ? 0.5f * (at + to) : centre(at, to, near, far)},
               steps_[ray]);
      at = to;
      near = far;
    }
    growLight(state);
  }
}

void FieldMarcher::closeLight(std::uint32_t ray) {
  MarchStep& light = states_[ray].light;
  if (light.opticalDepth > 0) {
    light.place /= light.opticalDepth;
    addLight(states_[ray], light, steps_[ray]);
    growLight(states_[ray]);
  }
  light = {};
}

// Takes a step whose `place` is the middle of its optical depth.
void FieldMarcher::addLight(State& state, MarchStep step, std::vector<MarchStep>& steps) const {
  if (!(step.opticalDepth > 0) || !(state.lit < hidden_)) return;
  // What is in front hides some of what is behind: of an even step of depth t the middle is at
  // 1 / t - 1 / (exp(t) - 1), about 1 / 2 - t / 12.
  step.place -= step.length * std::min(step.opticalDepth, 3.0f) * (1.0f / 12);
  step.place = std::clamp(step.place, step.begin, step.begin + step.length);
  // What is left where a ray ends does not depend on its steps.
  step.opticalDepth = std::min(step.opticalDepth, hidden_ - state.lit);
  steps.push_back(step);
  state.lit += step.opticalDepth;
}

// Steps grow as in the march of a grid, since less is seen of them.
void FieldMarcher::growLight(State& state) const {
  state.lightDepth = how_.lightDepth * std::min(std::exp(leastColour_ * state.lit * (1.0f / 3)), growth_);
}

}  // namespace nephele
