// What the level set and the knives make of a tetrahedron (tetrahedron_facets.cpp) depends, on each of its
// faces, on the samples of that face alone, so that the facets of all tetrahedra together are closed. A
// vertex is known by the functions that are 0 at it and the edge, face or tetrahedron in which it lies.
#include "nephele/levelset/cut/detail/tetrahedra/brick_carver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "nephele/levelset/cut/detail/solids/solid_split.h"

namespace nephele::detail {
namespace {

constexpr int kBrick = BrickGrid::kBrick;

}  // namespace

void BrickCarver::carve(CarvedBrick& brick) {
  brick_ = &brick;
  codes_.clear();
  functions_.evaluate(brick);
  for (int z = 0; z < kBrick; ++z)
    for (int y = 0; y < kBrick; ++y)
      for (int x = 0; x < kBrick; ++x) carveCell({x, y, z});
  finish();
}

void BrickCarver::carveCell(const Vec3i& cell) {
  constexpr std::array<int, 8> kSteps = [] {
    std::array<int, 8> steps{};
    for (unsigned c = 0; c < 8; ++c) {
      const Vec3i o = cornerOffset(c);
      steps[c] = sampleIndex(o);
    }
    return steps;
  }();
  const int start = sampleIndex(cell);
  const auto signsOf = [&](std::size_t f) {
    unsigned signs = 0;
    for (unsigned c = 0; c < 8; ++c)
      if (functions_[f].values[std::size_t(start + kSteps[c])] > 0) signs |= 1u << c;
    return signs;
  };
  const unsigned inside = signsOf(0);
  if (inside == 0) return;
  crossing_.clear();
  if (inside != 255) crossing_.push_back(0);
  for (std::size_t f = 1; f < functions_.count(); ++f)
    if (const unsigned signs = signsOf(f); signs != 0 && signs != 255) crossing_.push_back(f);
  if (crossing_.empty()) return;

  // Ways from one end of the diagonal to the other, along an axis at a time; every other one is odd.
  constexpr std::array<std::array<unsigned, 2>, 6> kWays{{{1, 3}, {1, 5}, {2, 6}, {2, 3}, {4, 5}, {4, 6}}};
  for (std::size_t w = 0; w < 6; ++w) {
    const std::array<unsigned, 4> corners{0, kWays[w][0], kWays[w][1], 7};
    values_.clear();
    here_.clear();
    bool isOutside = false;
    for (const std::size_t f : crossing_) {
      CornerValues v;
      for (std::size_t i = 0; i < 4; ++i)
        v[i] = functions_[f].values[std::size_t(start + kSteps[corners[i]])];
      const bool isPositive = v[0] > 0;
      if ((v[1] > 0) == isPositive && (v[2] > 0) == isPositive && (v[3] > 0) == isPositive) {
        isOutside |= f == 0 && !isPositive;
        continue;
      }
      values_.push_back(v);
      here_.push_back(f);
    }
    if (isOutside || here_.empty()) continue;
    for (const Facet& facet : facets_.of(values_)) addFacet(cell, corners, facet, w % 2 == 1);
  }
}

void BrickCarver::addFacet(const Vec3i& cell, const std::array<unsigned, 4>& corners, const Facet& facet,
                           bool isOdd) {
  const std::size_t function = here_[facet.function];
  if (here_[0] == 0 && function != 0 && !facet.isPositive[0]) return;
  const std::int32_t above = codeBeside(cell, facet, true);
  const std::int32_t below = function == 0 ? -1 : codeBeside(cell, facet, false);
  if (above < 0 && below < 0) return;
  ring_.clear();
  for (const FacetCorner& corner : facet.corners) {
    const VertexKey key = keyOf(cell, corners, corner);
    keys_.push_back(key);
    if (ring_.empty() || ring_.back() != key) ring_.push_back(key);
  }
  if (ring_.size() > 1 && ring_.front() == ring_.back()) ring_.pop_back();
  if (ring_.size() < 3) return;
  const bool isMirrored = isOdd != (determinant(carving_.level.indexToWorld().linear) < 0);
  if (isMirrored) std::reverse(ring_.begin(), ring_.end());
  places_.clear();
  for (const VertexKey& key : ring_) places_.push_back(placeOf(key));
  const std::uint32_t parent = function == 0 ? 0 : kOnPlane | frameOf(function);
  const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
    if (above >= 0)
      brick_->triangles.push_back({{ring_[a], ring_[b], ring_[c]}, parent, std::uint32_t(above)});
    if (below >= 0)
      brick_->triangles.push_back({{ring_[a], ring_[c], ring_[b]}, parent, std::uint32_t(below)});
  };
  const auto cutOff = [&](std::size_t ear) {
    const std::size_t count = ring_.size();
    add((ear + count - 1) % count, ear, (ear + 1) % count);
    ring_.erase(ring_.begin() + std::ptrdiff_t(ear));
    places_.erase(places_.begin() + std::ptrdiff_t(ear));
  };
  // The same for both sides of a kerf, see BladeVertices.
  if (carving_.functionsPerKnife() == 2 && function != 0 && ring_.size() == 4 && facet.corners.size() == 4) {
    constexpr std::uint8_t kDiagonal = 0b1001;
    const auto corner = std::find_if(facet.corners.begin(), facet.corners.end(),
                                     [](const FacetCorner& c) { return c.carrier == kDiagonal; });
    const auto place = std::size_t(corner - facet.corners.begin()) % 4;
    cutOff(isMirrored ? 3 - place : place);
  }
  // Ears with the shortest cuts first.
  while (ring_.size() > 3) {
    const std::size_t count = ring_.size();
    std::size_t ear = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d cut = places_[(i + 1) % count] - places_[(i + count - 1) % count];
      if (const double squared = dot(cut, cut); squared < least) least = squared, ear = i;
    }
    cutOff(ear);
  }
  add(0, 1, 2);
}

std::int32_t BrickCarver::codeBeside(const Vec3i& cell, const Facet& facet, bool isAbove) {
  signs_.clear();
  std::size_t next = here_[0] == 0 ? 1 : 0;
  for (std::size_t f = 1; f < functions_.count(); ++f) {
    bool isPositive;
    if (next < here_.size() && here_[next] == f) {
      isPositive = facet.function == next ? isAbove : facet.isPositive[next] != 0;
      ++next;
    } else {
      isPositive = functions_[f].values[std::size_t(sampleIndex(cell))] > 0;
    }
    signs_.push_back(isPositive ? '+' : '-');
  }
  const auto [entry, isNew] = codes_.try_emplace(signs_, -1);
  if (!isNew) return entry->second;
  std::vector<bool> sides(brick_->isPositive.begin(), brick_->isPositive.end());
  for (std::size_t i = 0; i < brick_->undecided.size(); ++i) {
    const std::size_t per = carving_.functionsPerKnife();
    const bool isHigh = signs_[i * per] == '+', isLow = signs_[i * per + per - 1] == '-';
    if (!isHigh && !isLow) return -1;
    sides[brick_->undecided[i]] = isHigh;
  }
  entry->second = std::int32_t(brick_->codes.size());
  brick_->codes.push_back(std::move(sides));
  return entry->second;
}

VertexKey BrickCarver::keyOf(const Vec3i& cell, const std::array<unsigned, 4>& corners,
                             const FacetCorner& corner) const {
  std::array<unsigned, 4> carrier{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < 4; ++i)
    if (corner.carrier >> i & 1) carrier[count++] = corners[i];
  std::array<std::uint32_t, 3> ids{};
  for (std::size_t i = 0; i < corner.count; ++i) ids[i] = functions_[here_[corner.functions[i]]].id;
  const Vec3i base = cell + cornerOffset(carrier[0]);
  if (corner.count == 1) {
    const std::size_t f = here_[corner.functions[0]];
    const Vec3i other = cell + cornerOffset(carrier[1]);
    const bool isPositive = functions_[f].values[std::size_t(sampleIndex(base))] > 0;
    const Vec3i& negative = isPositive ? other : base;
    if (functions_[f].isVertex[std::size_t(sampleIndex(negative))]) return keyOfSample(f, negative);
  }
  return {base, carrier[1] ^ carrier[0], count == 2 ? 0 : carrier[2] ^ carrier[0],
          std::span(ids).first(corner.count)};
}

VertexKey BrickCarver::keyOfSample(std::size_t f, const Vec3i& sample) const {
  const int r = ringIndex(sample.x, sample.y, sample.z);
  std::size_t n = 0;
  while (functions_.ringValue(f, r + kEdgeSteps[n]) <= 0) ++n;
  const auto corner = unsigned(n % 7 + 1);
  return {n < 7 ? sample : sample - cornerOffset(corner), corner, 0, std::span(&functions_[f].id, 1)};
}

Vec3d BrickCarver::placeOf(const VertexKey& key) const {
  const std::size_t count = key.functionCount();
  const Vec3i base = key.base() + key.owner() * kBrick;
  const std::array<unsigned, 4> offsets{0, key.first(), key.second(), 7};
  std::array<CornerValues, 3> rows{};
  FacetCorner corner{std::uint8_t((2u << count) - 1), std::uint8_t(count), {0, 1, 2}};
  if (count == 1)
    for (const std::size_t c : {0, 1})
      if (BrickFunctions::isVertexAt(functions_.byId(key.function(0)), base + cornerOffset(offsets[c])))
        return Vec3d(base + cornerOffset(offsets[c]));
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t c = 0; c <= count; ++c)
      rows[i][c] =
          functions_.byId(key.function(i)).values[std::size_t(sampleIndex(base + cornerOffset(offsets[c])))];
  const auto weights = weightsOf(corner, rows);
  Vec3d place(base);
  for (std::size_t c = 1; c <= count; ++c) place += Vec3d(cornerOffset(offsets[c])) * weights[c];
  return place;
}

std::uint32_t BrickCarver::frameOf(std::size_t f) const {
  const std::uint32_t knife = (functions_[f].id - 1) / carving_.functionsPerKnife();
  const std::uint32_t first = carving_.firstFrame[knife];
  if (carving_.knives[knife].frame) return first;
  Vec3d normal{};
  const Vec3d origin = carving_.world(places_[0]);
  for (std::size_t i = 1; i + 1 < places_.size(); ++i)
    normal += cross(carving_.world(places_[i]) - origin, carving_.world(places_[i + 1]) - origin);
  const double x = std::abs(normal.x), y = std::abs(normal.y), z = std::abs(normal.z);
  return first + (x >= y && x >= z ? 0 : y >= z ? 1 : 2);
}

void BrickCarver::finish() {
  std::sort(keys_.begin(), keys_.end());
  keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
  brick_->keys = std::move(keys_);
  keys_.clear();
  for (const VertexKey& key : brick_->keys) {
    if (!key.isOwn()) break;
    brick_->positions.push_back(carving_.world(placeOf(key) + Vec3d(brick_->at * kBrick)));
  }
  blades_.move(functions_, *brick_);
  brick_->undecided = {};
  brick_->isPositive = {};
}

}  // namespace nephele::detail
