// What paths meet of a field: the same as of a grid, with bounds from the ranges of its cells.
//
// Where tentative collisions are does not depend on the densities there. So every way lays some of them
// ahead, those of all ways are evaluated together, and the ways that go on lay more.
#include <algorithm>
#include <cmath>
#include <utility>

#include "nephele/render/march/detail/path_volume.h"
#include "nephele/render/volume/ray_span.h"

namespace nephele::detail {

namespace {

// Tentative collisions that a way lays at first, and at most.
constexpr std::size_t kAhead = 4, kMostAhead = 32;

float largest(const Vec3f& v) {
  return std::max({v.x, v.y, v.z});
}

}  // namespace

// Follows a way from where it enters the field, if it does.
void PathVolume::follow(std::uint32_t way, const Ray& ray, double length, const PathRandom& random,
                        const FieldGlow* glow, Scratch& scratch) const {
  const RaySpan span = clipped({0, length}, ray.origin, ray.direction, bounds_);
  if (span.isEmpty()) return;
  const FieldDensity::Line line{Vec3f(ray.origin + ray.direction * span.near), Vec3f(ray.direction),
                                float(span.far - span.near)};
  Scratch::Track& track = scratch.tracks.emplace_back(
      Scratch::Track{way, span.near, line, GlowingWalk(*field_, glow, line), random});
  track.depth = track.random.depth();
}

// Goes on to the next tentative collision; false at the end of the line. `isResidual`: of what the density
// has above its least.
bool PathVolume::advance(Scratch::Track& track, float extinction, bool isResidual) const {
  for (;;) {
    if (!track.hasSpan) {
      if (!track.walk.next(track.span)) return false;
      track.hasSpan = true;
      track.s = track.span.begin;
      Interval& range = track.span.range;
      range = {std::min(range.min, mostDensity_), std::min(range.max, mostDensity_)};
    }
    const float least = isResidual ? track.span.range.min : 0.0f;
    float bound = extinction * (track.span.range.max - least);
    if (track.span.glows) bound = std::max(bound, leastBound_);
    track.bound = bound;
    const float step = track.depth / bound;
    if (track.s + step < track.span.end) {
      track.passed += extinction * least * step;
      track.s += step;
      track.depth = track.random.depth();
      return true;
    }
    const float rest = track.span.end - track.s;
    track.passed += extinction * least * rest;
    track.depth = std::max(0.0f, track.depth - rest * bound);
    track.hasSpan = false;
  }
}

// Finds what glows at tentative collisions.
void PathVolume::askGlow(Scratch& scratch) const {
  std::size_t count = 0;
  for (const Scratch::Tentative& tentative : scratch.tentative) count += tentative.glows;
  for (std::vector<float>& lane : scratch.glow) lane.resize(count);
  std::size_t next = 0;
  for (const Scratch::Track& track : scratch.tracks)
    for (std::size_t i = track.first; i != track.end; ++i) {
      if (!scratch.tentative[i].glows) continue;
      const Vec3f place = track.line.at(scratch.tentative[i].s);
      for (int axis = 0; axis != 3; ++axis) scratch.glow[std::size_t(axis)][next] = place[axis];
      ++next;
    }
  const auto& [x, y, z, red, green, blue] = scratch.glow;
  fieldGlow_->emission.eval({x, y, z}, {{scratch.glow[3], scratch.glow[4], scratch.glow[5]}});
  next = 0;
  for (Scratch::Tentative& tentative : scratch.tentative) {
    if (!tentative.glows) continue;
    tentative.glow = FieldGlow::counted({red[next], green[next], blue[next]});
    ++next;
  }
}

// Until every track is done: lets each lay tentative collisions, evaluates the densities that are asked for,
// and hands them out.
template <class Lay, class Answer>
void PathVolume::followAll(Scratch& scratch, Lay&& lay, Answer&& answer) const {
  for (std::size_t ahead = kAhead; !scratch.tracks.empty(); ahead = std::min(2 * ahead, kMostAhead)) {
    scratch.tentative.clear();
    scratch.batch.clear();
    for (Scratch::Track& track : scratch.tracks) {
      track.first = scratch.tentative.size();
      while (scratch.tentative.size() != track.first + ahead && !track.isAtEnd) lay(track);
      track.end = scratch.tentative.size();
    }
    if (fieldGlow_) askGlow(scratch);
    const float* value = scratch.batch.eval(*field_).data();
    for (Scratch::Track& track : scratch.tracks) {
      track.isDone = false;
      for (std::size_t i = track.first; i != track.end; ++i) {
        const Scratch::Tentative& tentative = scratch.tentative[i];
        const float density = tentative.isAsked ? std::min(*value++, mostDensity_) : tentative.range.max;
        if (!track.isDone) track.isDone = !answer(track, tentative, density);
      }
      if (track.isAtEnd) track.isDone = true;
    }
    std::erase_if(scratch.tracks, [](const Scratch::Track& track) { return track.isDone; });
  }
}

void PathVolume::flyThroughField(std::span<Flight> flights, Scratch& scratch) const {
  scratch.tracks.clear();
  for (std::size_t i = 0; i != flights.size(); ++i)
    follow(std::uint32_t(i), flights[i].ray, flights[i].length, flights[i].random.fork(), fieldGlow_,
           scratch);
  const auto lay = [&](Scratch::Track& track) {
    if (!advance(track, extinction_, false)) {
      track.isAtEnd = true;
      return;
    }
    const Interval& range = track.span.range;
    const float chance = track.random.next();
    // Whatever the density is, it is real; nothing behind it matters.
    const bool isSure = !isColoured_ && chance * range.max < range.min;
    track.isAtEnd = isSure;
    scratch.tentative.push_back(
        {track.s, 0, range, chance, !isSure && !range.isPoint(), track.bound, track.span.glows});
    if (scratch.tentative.back().isAsked) scratch.batch.add(*field_, track.line, track.s, track.span.region);
  };
  followAll(scratch, lay, [&](const Scratch::Track& track, const Scratch::Tentative& t, float density) {
    Flight& flight = flights[track.way];
    const double distance = track.start + double(t.s);
    if (isColoured_) {
      if (!(flight.weight.x + flight.weight.y + flight.weight.z > 0)) return false;
      if (t.glows) addGlow(flight, t.glow, t.bound, distance);
      return !isReal(flight, colour_ * std::min(extinction_ * density / t.bound, 1.0f), distance);
    }
    if (!(t.chance < density / t.range.max)) return true;
    flight.distance = distance;
    return false;
  });
}

void PathVolume::lookThroughField(std::span<ShadowWay> ways, Scratch& scratch) const {
  scratch.tracks.clear();
  for (std::size_t i = 0; i != ways.size(); ++i)
    if (largest(ways[i].extinction) > 0)
      follow(std::uint32_t(i), ways[i].ray, ways[i].length, ways[i].random.fork(), nullptr, scratch);
  const auto lay = [&](Scratch::Track& track) {
    track.isAtEnd = !advance(track, extinction_ * largest(ways[track.way].extinction), true);
    // What was passed to the end is a tentative collision with nothing.
    const Interval range = track.isAtEnd ? Interval::of(0) : track.span.range;
    scratch.tentative.push_back({track.s, std::exchange(track.passed, 0.0f), range, 0, !track.isAtEnd});
    if (!track.isAtEnd) scratch.batch.add(*field_, track.line, track.s, track.span.region);
  };
  followAll(scratch, lay, [&](const Scratch::Track& track, const Scratch::Tentative& t, float density) {
    ShadowWay& way = ways[track.way];
    const float most = largest(way.extinction);
    dim(way, t.passed / most);
    if (t.isAsked)
      way.left = way.left * (Vec3f{1, 1, 1} - way.extinction * (residualOf(density, t.range) / most));
    return isWorthwhile(way);
  });
}

}  // namespace nephele::detail
