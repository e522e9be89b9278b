// From what rays recorded to deep samples.
//
// The opacity A(z) and colour C(z) in front of depth z are means over the rays of a pixel, so they are added
// up as functions of depth, at the depths where any ray changes, with straight lines between. Samples are
// then as long as they can be: from one knot to the farthest one such that a homogeneous medium between the
// two follows A and C at all knots passed within the tolerance.
//
// Alpha and colour are 16 bit numbers. Each sample is computed from what those before it really give, so that
// rounding errors are made up for by the next sample instead of adding up.
//
// Limits: within a block of steps colour is taken to grow with opacity. Rays' knots closer in opacity than a
// fraction of the tolerance are left out.
#include "nephele/render/march/detail/deep_pixel.h"

#include <algorithm>
#include <cmath>

namespace nephele::detail {

namespace {

// The largest 16 bit number below 1.
constexpr float kNearlyOpaque = 1 - 1.0f / 2048;

float most(const Vec3f& v) {
  return std::max({v.x, v.y, v.z});
}

float difference(const Vec3f& a, const Vec3f& b) {
  return std::max({std::fabs(a.x - b.x), std::fabs(a.y - b.y), std::fabs(a.z - b.z)});
}

}  // namespace

void DeepPixel::begin(std::size_t rayCount) {
  rayCount_ = rayCount;
  knots_.clear();
  rayEnds_.clear();
}

void DeepPixel::add(const MarchRay& ray, const MarchRecord& record, const Gains& gains) {
  const auto colourOf = [&](const MarchResult& light) {
    Vec3f colour;
    for (std::size_t part = 0; part != gains.sky.size(); ++part) colour += light.sky[part] * gains.sky[part];
    for (int c = 0; c != 3; ++c) {
      const int from = gains.isGrey ? 0 : c;
      colour[c] += light.emission[c];
      for (std::size_t sun = 0; sun != gains.sunCount; ++sun)
        colour[c] += gains.suns[sun][c] * light.suns[sun][from];
    }
    return colour;
  };
  const auto depthAt = [&](float s) { return (ray.start + s) * ray.cosine; };
  // A ray is one of many: what matters is its share of the pixel's opacity.
  const float least =
      std::clamp(options_.tolerance * float(rayCount_) / 8, options_.tolerance / 4, options_.tolerance * 8);
  const std::size_t firstKnot = knots_.size();
  Knot last;
  std::size_t step = 0;
  for (const MarchRecord::Mark& mark : record.marks) {
    if (mark.stepCount == step) {
      last.colour = colourOf(mark.result);
      continue;
    }
    const float from = last.opacity, to = record.steps[mark.stepCount - 1].opacity;
    const std::size_t blockSteps = mark.stepCount - step, blockStart = step;
    const Vec3f before = last.colour, after = colourOf(mark.result);
    for (; step != mark.stepCount; ++step) {
      const MarchRecord::Step& s = record.steps[step];
      const bool isFirst = knots_.size() == firstKnot;
      const float z0 = depthAt(s.begin), z1 = depthAt(s.end);
      // Where there was nothing for a while, the way through it is a knot of its own.
      if (isFirst || z0 > last.z + 0.5f * (z1 - z0)) {
        if (!isFirst && knots_.back().z < last.z) knots_.push_back(last);
        knots_.push_back({isFirst ? z0 : std::max(z0, last.z), last.opacity, last.colour});
      }
      const float share =
          to > from ? (s.opacity - from) / (to - from) : float(step - blockStart + 1) / float(blockSteps);
      last = {z1, s.opacity, before + (after - before) * share};
      if (last.opacity - knots_.back().opacity >= least) knots_.push_back(last);
    }
    last.colour = after;
  }
  if (knots_.size() != firstKnot && knots_.back().z < last.z) knots_.push_back(last);
  rayEnds_.push_back(knots_.size());
}

void DeepPixel::addSurface(float depth, float opacity, const Vec3f& colour) {
  const std::size_t start = rayEnds_.size() < 2 ? 0 : rayEnds_[rayEnds_.size() - 2];
  Knot last;
  if (knots_.size() != start) last = knots_.back();
  depth = std::max(depth, last.z);
  knots_.push_back({depth, last.opacity, last.colour});
  knots_.push_back({std::nextafter(depth, INFINITY), last.opacity + opacity, last.colour + colour});
  rayEnds_.back() = knots_.size();
}

// The mean of all rays at every depth where one of them has a knot.
void DeepPixel::merge() {
  depths_.clear();
  for (const Knot& knot : knots_) depths_.push_back(knot.z);
  std::sort(depths_.begin(), depths_.end());
  depths_.erase(std::unique(depths_.begin(), depths_.end()), depths_.end());
  mean_.assign(depths_.size(), {});
  for (std::size_t i = 0; i != depths_.size(); ++i) mean_[i].z = depths_[i];
  const float share = 1.0f / float(rayCount_);
  std::size_t begin = 0;
  for (const std::size_t end : rayEnds_) {
    std::size_t next = begin;
    for (std::size_t i = 0; i != depths_.size() && begin != end; ++i) {
      while (next != end && knots_[next].z <= depths_[i]) ++next;
      if (next == begin) continue;
      const Knot& a = knots_[next - 1];
      float opacity = a.opacity;
      Vec3f colour = a.colour;
      if (next != end) {
        const Knot& b = knots_[next];
        const float way = (depths_[i] - a.z) / (b.z - a.z);
        opacity += (b.opacity - a.opacity) * way;
        colour += (b.colour - a.colour) * way;
      }
      mean_[i].opacity += share * opacity;
      mean_[i].colour += colour * share;
    }
    begin = end;
  }
}

// Whether one homogeneous sample does for all between two knots.
bool DeepPixel::fits(std::size_t first, std::size_t last) const {
  const Knot &a = mean_[first], &b = mean_[last];
  const float left = 1 - a.opacity, gain = b.opacity - a.opacity;
  const float alpha = left > 0 ? std::min(gain / left, 0.99999f) : 0.0f;
  const float depth = -std::log1p(-alpha), tolerance = options_.tolerance;
  for (std::size_t i = first + 1; i < last; ++i) {
    const Knot& knot = mean_[i];
    const float way = (knot.z - a.z) / (b.z - a.z);
    const float share = alpha > 1e-6f ? -std::expm1(-depth * way) / alpha : way;
    if (std::fabs(a.opacity + gain * share - knot.opacity) > tolerance ||
        difference(a.colour + (b.colour - a.colour) * share, knot.colour) > tolerance * brightness_)
      return false;
  }
  return true;
}

std::vector<DeepSample> DeepPixel::samples() {
  merge();
  return cut();
}

std::vector<DeepSample> DeepPixel::samples(std::vector<Event>& events, std::size_t pathCount) {
  std::stable_sort(events.begin(), events.end(),
                   [](const Event& a, const Event& b) { return a.depth < b.depth; });
  mean_.clear();
  const double share = 1.0 / double(pathCount);
  double opacity = 0;
  Vec3d colour;
  Knot last;
  for (std::size_t i = 0; i != events.size();) {
    const std::size_t first = i;
    const float depth = events[i].depth;
    for (; i != events.size() && events[i].depth == depth; ++i) {
      opacity += double(events[i].opacity);
      colour += Vec3d(events[i].colour);
    }
    const Knot next{depth, float(opacity * share), Vec3f(colour * share)};
    // A jump where several paths met it, and where there is nothing in front.
    if (const bool isJump = first == 0 || i - first > 1; isJump) {
      if (first == 0 || depth > last.z) mean_.push_back({depth, last.opacity, last.colour});
      last = next;
      last.z = std::nextafter(depth, INFINITY);
    } else {
      last = next;
    }
    if (!mean_.empty() && last.z <= mean_.back().z) last.z = std::nextafter(mean_.back().z, INFINITY);
    mean_.push_back(last);
  }
  return cut();
}

// A thin sample behind the last one, of what it may not hold.
void DeepPixel::close(std::vector<DeepSample>& samples, const FlatPixel& front) const {
  constexpr float kWorthIt = 1e-4f;
  const float left = 1 - front.alpha, missing = mean_.back().opacity - front.alpha;
  if (!(left > 0) || missing < kWorthIt || samples.empty()) return;
  DeepSample last{samples.back().zBack, samples.back().zBack, roundedToHalf(std::min(missing / left, 1.0f))};
  for (int c = 0; c != 3; ++c)
    last.colour[c] = roundedToHalf(std::max((mean_.back().colour[c] - front.colour[c]) / left, 0.0f));
  samples.push_back(last);
}

// Samples as long as they can be.
std::vector<DeepSample> DeepPixel::cut() {
  std::vector<DeepSample> result;
  if (mean_.size() < 2) return result;
  brightness_ = most(mean_.back().colour);
  // As it will be read.
  FlatPixel front;
  for (std::size_t first = 0; first + 1 < mean_.size();) {
    std::size_t last = first + 1;
    if (mean_[last].opacity > mean_[first].opacity || mean_[last].colour != mean_[first].colour) {
      // Longer and longer, then between the last that did and the first that did not.
      std::size_t stride = 1, tooFar = mean_.size();
      while (last + stride < mean_.size()) {
        if (!fits(first, last + stride)) {
          tooFar = last + stride;
          break;
        }
        last += stride;
        stride *= 2;
      }
      for (; stride != 0; stride /= 2)
        if (last + stride < tooFar && fits(first, last + stride)) last += stride;
      const float left = 1 - front.alpha;
      if (left > 0) {
        const float scale = 1 / left;
        DeepSample sample{mean_[first].z, mean_[last].z,
                          roundedToHalf(std::clamp((mean_[last].opacity - front.alpha) * scale, 0.0f, 1.0f))};
        // All of what has alpha 1 is opaque from its front on, to all who read it.
        if (sample.zBack > std::nextafter(sample.z, INFINITY))
          sample.alpha = std::min(sample.alpha, kNearlyOpaque);
        for (int c = 0; c != 3; ++c)
          sample.colour[c] = roundedToHalf(std::max((mean_[last].colour[c] - front.colour[c]) * scale, 0.0f));
        if (sample.alpha > 0 || sample.colour != Vec3f{}) {
          result.push_back(sample);
          front.colour += sample.colour * left;
          front.alpha += sample.alpha * left;
        }
      }
    }
    first = last;
  }
  close(result, front);
  result.shrink_to_fit();
  return result;
}

}  // namespace nephele::detail
