// What paths meet of a grid.
//
// Free paths: delta tracking (Woodcock 1965). In every brick the extinction is at most extinction * largest
// density of the brick; tentative collisions are drawn for that bound, and each is real with the share that
// the density there has of it. Bricks without density are skipped as the marcher skips them. Transmittances:
// residual ratio tracking (Novak, Selle, Jarosz 2014). What the smallest density of a brick takes is known,
// the rest is a walk whose tentative collisions multiply by the share that is not real, ended by Russian
// roulette where little is left.
#include "nephele/render/march/detail/path_volume.h"

#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/brick_box.h"
#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/render/volume/brick_walk.h"
#include "nephele/render/volume/ray_span.h"

namespace nephele::detail {

namespace {

// Larger optical depths of a voxel count as this: nothing of them is seen but their surface.
constexpr float kMostDepth = 1e4f;
// From this optical depth of a voxel on it is worth while to look at each.
constexpr float kOpaque = 3.0f;
// From a sample of a brick to the next one along y and z.
constexpr int kRow = BrickGrid::kWidth, kPlane = kRow * kRow;

float largest(const Vec3f& v) {
  return std::max({v.x, v.y, v.z});
}

// Values below zero count as zero.
float valueAt(const float* values, const MarchScene::ColourBricks& bricks, const Vec3f& p) {
  return std::fmax(0.0f, GridSampler{values, bricks.table, bricks.count}(p));
}

}  // namespace

// The part of a way that lies in the volume's box, on its lattice.
struct PathVolume::Part {
  LatticeRay ray;
  double start;
  float length;
};

PathVolume::PathVolume(const RenderVolume& volume, const Medium& medium)
    : field_(volume.field()),
      fieldColour_(volume.fieldColour()),
      fieldGlow_(volume.fieldGlow()),
      density_{volume.density().values().data(), volume.density().table().data(),
               volume.density().brickCount()},
      toLattice_(volume.density().worldToIndex(), volume.density().firstBrick()),
      albedo_(medium.albedo),
      // That of the most opaque colour.
      extinction_(medium.extinction * largest(medium.extinctionColour)),
      colour_(medium.extinctionColour / largest(medium.extinctionColour)),
      perEmission_(medium.extinction) {
  require(volume.hasSamples(), "path tracer: the samples of the density were given back");
  const BrickGrid& grid = volume.density();
  scene_.density = {grid.values().data(), grid.table().data(), grid.brickCount()};
  scene_.ranges = grid.ranges().data();
  scene_.emptiness = volume.emptiness().data();
  const auto take = [](const VolumeColour::Grids& grids, MarchScene::ColourBricks& bricks) {
    for (std::size_t c = 0; c != 3; ++c) bricks.values[c] = grids[c]->values().data();
    bricks.table = grids[0]->table().data();
    bricks.count = grids[0]->brickCount();
  };
  if (volume.hasColour()) take(volume.colour().scattering, scene_.colour);
  if (volume.hasEmission()) {
    take(volume.colour().emission, scene_.emission);
    leastBound_ = 1 / (BrickGrid::kBrick * (field_ ? field_->cell() : grid.voxelSize()));
  }
  isColoured_ = volume.hasEmission() || colour_ != Vec3f{1, 1, 1};
  const float size = field_ ? field_->cell() : grid.voxelSize();
  mostDensity_ = kMostDepth / (extinction_ * size);
  opaqueDensity_ = kOpaque / (extinction_ * size);
  least_ = 1e-4f * size;
  const Vec3f corner(grid.firstBrick() * BrickGrid::kBrick);
  bounds_ =
      field_ ? field_->box() : Box{volume.indexBounds().min - corner, volume.indexBounds().max - corner};
}

bool PathVolume::enter(const Ray& ray, double length, Part& out) const {
  const Vec3d origin = toLattice_.point(ray.origin), direction = toLattice_.vector(ray.direction);
  const RaySpan span = clipped({0, length}, origin, direction, bounds_);
  out = {{Vec3f(origin + direction * span.near), Vec3f(direction)}, span.near, float(span.far - span.near)};
  return !span.isEmpty();
}

// Calls visit(begin, end, cell) for the cells of a brick that a ray passes from `begin` to `end`, until it
// returns false; whether it never did.
template <class Visit>
bool walkCells(const LatticeRay& ray, float begin, float end, Visit&& visit) {
  const Vec3f middle = ray.origin + ray.direction * (0.5f * (begin + end));
  Vec3i cell;
  Vec3f exits, perCell;
  for (int axis = 0; axis != 3; ++axis) {
    const float low = 8.0f * std::floor(middle[axis] * 0.125f), direction = ray.direction[axis];
    const float local = ray.origin[axis] + direction * begin - low;
    cell[axis] = std::clamp(int(std::floor(local)), 0, 7);
    perCell[axis] = std::fabs(1 / direction);
    exits[axis] = direction == 0
                      ? std::numeric_limits<float>::infinity()
                      : (low + float(cell[axis] + (direction > 0 ? 1 : 0)) - ray.origin[axis]) / direction;
  }
  for (float s = begin;;) {
    const int axis = exits.x <= exits.y ? (exits.x <= exits.z ? 0 : 2) : (exits.y <= exits.z ? 1 : 2);
    const float out = std::clamp(exits[axis], s, end);
    if (out > s && !visit(s, out, cell)) return false;
    if (!(out < end)) return true;
    s = out;
    cell[axis] = std::clamp(cell[axis] + (ray.direction[axis] > 0 ? 1 : -1), 0, 7);
    exits[axis] += perCell[axis];
  }
}

// Tentative collisions along a way: calls meet(s, rate, range) at each until it returns false; rateOf(range)
// is the extinction that they are drawn for where the density lies in the range. leave(length, range) for
// every part of one range that was crossed, as it is left.
template <class RateOf, class Meet, class Leave>
void PathVolume::collide(const Part& part, PathRandom& random, RateOf&& rateOf, Meet&& meet,
                         Leave&& leave) const {
  double depth = double(random.depth());
  const auto cross = [&](float begin, float end, const Interval& range) {
    const double rate = double(rateOf(range));
    for (double s = double(begin);;) {
      const double step = depth / rate;
      if (!(s + step < double(end))) {
        depth = std::max(0.0, depth - (double(end) - s) * rate);
        return leave(end - begin, range);
      }
      s += step;
      if (!meet(float(s), float(rate), range)) return false;
      depth = double(random.depth());
    }
  };
  walkBricks(scene_, part.ray, part.length, [&](float begin, float end, std::int32_t pool) {
    const Interval range = boundsOf(scene_.ranges[pool]);
    if (range.max <= opaqueDensity_ || range.isPoint()) return cross(begin, end, range);
    // Where voxels are opaque each has bounds of its own, or most of the work were nearly empty ones.
    return walkCells(part.ray, begin, end, [&](float from, float to, const Vec3i& cell) {
      const float* first = density_.firstOf(pool, cell);
      Interval corners = Interval::of(first[0]);
      for (const int offset : {1, kRow, kRow + 1, kPlane, kPlane + 1, kPlane + kRow, kPlane + kRow + 1}) {
        corners.min = std::min(corners.min, first[offset]);
        corners.max = std::max(corners.max, first[offset]);
      }
      return cross(from, to, boundsOf(corners));
    });
  });
}

Vec3f PathVolume::albedoAt(const Vec3d& place) const {
  if (fieldColour_) {
    const Vec3f colour = (*fieldColour_)(Vec3f(place));
    Vec3f result;
    for (int c = 0; c != 3; ++c) result[c] = colour[c] > 0 ? albedo_[c] * std::min(colour[c], 1.0f) : 0.0f;
    return result;
  }
  if (!scene_.colour.table) return albedo_;
  const Vec3f p(toLattice_.point(place));
  const float there = density_(p);
  Vec3f result;
  for (int c = 0; c != 3 && there > 0; ++c)
    result[c] = albedo_[c] * valueAt(scene_.colour.values[c], scene_.colour, p) / there;
  return result;
}

void PathVolume::fly(std::span<Flight> flights, Scratch& scratch) const {
  if (field_) return flyThroughField(flights, scratch);
  for (Flight& flight : flights) fly(flight);
}

void PathVolume::look(std::span<ShadowWay> ways, Scratch& scratch) const {
  if (field_) return lookThroughField(ways, scratch);
  for (ShadowWay& way : ways) look(way);
}

void PathVolume::fly(Flight& flight) const {
  Part part;
  if (!enter(flight.ray, flight.length, part)) return;
  if (isColoured_) return flyInColours(part, flight);
  collide(
      part, flight.random, [&](const Interval& range) { return extinction_ * range.max; },
      [&](float s, float, const Interval& range) {
        const float least = flight.random.next() * range.max;
        if (!(least < range.min) && !(least < densityAt(part.ray.origin + part.ray.direction * s)))
          return true;
        flight.distance = part.start + double(s);
        return false;
      },
      [](float, const Interval&) { return true; });
}

bool PathVolume::isReal(Flight& flight, const Vec3f& real, double distance) const {
  const float sum = flight.weight.x + flight.weight.y + flight.weight.z;
  const float chance = dot(flight.weight, real) / sum;
  if (flight.random.next() < chance) {
    flight.weight = flight.weight * real / chance;
    flight.distance = distance;
    return true;
  }
  const Vec3f before = flight.weight;
  flight.arriving = flight.weight = flight.weight * (Vec3f{1, 1, 1} - real) / (1 - chance);
  if (flight.foreground) {
    const Vec3f opacity = (before - flight.weight) * flight.foreground->heldAt(distance);
    flight.foreground->opacity += opacity;
    flight.foreground->albedo += opacity * albedoAt(flight.ray.origin + flight.ray.direction * distance);
  }
  return false;
}

void PathVolume::addGlow(Flight& flight, const Vec3f& emission, float bound, double distance) const {
  const float held = flight.foreground ? flight.foreground->heldAt(distance) : 1.0f;
  const Vec3f glow = flight.weight * emission * (held * perEmission_ / bound);
  flight.glow += Vec3d(glow);
  if (flight.foreground && flight.foreground->glow && glow != Vec3f{})
    flight.foreground->glow->push_back({float(distance * flight.foreground->cosine), 0, glow});
}

// Where colours differ in extinction, or something glows: at each tentative collision the path sees what
// glows there per extinction.
void PathVolume::flyInColours(const Part& part, Flight& flight) const {
  collide(
      part, flight.random,
      [&](const Interval& range) { return std::fmax(extinction_ * range.max, leastBound_); },
      [&](float s, float bound, const Interval&) {
        const Vec3f p = part.ray.origin + part.ray.direction * s;
        const double distance = part.start + double(s);
        if (!(flight.weight.x + flight.weight.y + flight.weight.z > 0)) return false;
        if (scene_.emission.table) {
          Vec3f emission;
          for (int c = 0; c != 3; ++c) emission[c] = valueAt(scene_.emission.values[c], scene_.emission, p);
          addGlow(flight, emission, bound, distance);
        }
        return !isReal(flight, colour_ * std::fmin(extinction_ * densityAt(p) / bound, 1.0f), distance);
      },
      [](float, const Interval&) { return true; });
}

// Russian roulette; false where nothing is left.
bool PathVolume::survives(ShadowWay& way) {
  const float most = largest(way.left);
  if (way.random.next() * kLeastTransmittance >= most) {
    way.left = {};
    return false;
  }
  way.left *= kLeastTransmittance / most;
  return true;
}

// By an optical depth that is known.
void PathVolume::dim(ShadowWay& way, float depth) {
  if (!(depth > 0)) return;
  const Vec3f& extinction = way.extinction;
  const float red = std::exp(-depth * extinction.x);
  way.left.x *= red;
  way.left.y *= extinction.y == extinction.x ? red : std::exp(-depth * extinction.y);
  way.left.z *= extinction.z == extinction.x ? red : std::exp(-depth * extinction.z);
}

void PathVolume::look(ShadowWay& way) const {
  const float most = largest(way.extinction);
  Part part;
  if (!(most > 0) || !enter(way.ray, way.length, part)) return;
  const Vec3f share = way.extinction / most;
  collide(
      part, way.random, [&](const Interval& range) { return extinction_ * most * (range.max - range.min); },
      [&](float s, float, const Interval& range) {
        const float there = densityAt(part.ray.origin + part.ray.direction * s);
        way.left = way.left * (Vec3f{1, 1, 1} - share * residualOf(there, range));
        return isWorthwhile(way);
      },
      [&](float length, const Interval& range) {
        dim(way, extinction_ * range.min * length);
        return isWorthwhile(way);
      });
}

}  // namespace nephele::detail
