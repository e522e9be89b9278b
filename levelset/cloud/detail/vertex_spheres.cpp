// Spheres of similar radius share a grid whose cells are twice as wide as the largest of them: a sphere that
// contains a point has its centre in one of the eight cells around the corner nearest to the point. Spheres
// are sorted by level, cell and index, so that sums have one order.
#include "nephele/levelset/cloud/detail/vertex_spheres.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace nephele::detail {

namespace {

constexpr int kCellBits = 21;
/// Cells along the longest side; more would not fit the bits of an axis.
constexpr float kMostCells = float(1 << (kCellBits - 2));

std::uint64_t cellAt(std::int64_t x, std::int64_t y, std::int64_t z) {
  constexpr std::uint64_t kMask = (std::uint64_t(1) << kCellBits) - 1;
  // One is added, so that no cell is 0, which marks a free slot, and the cell before the first is not
  // negative.
  const auto bits = [](std::int64_t i) { return std::uint64_t(i + 1) & kMask; };
  return std::uint64_t(1) << 63 | bits(z) << (2 * kCellBits) | bits(y) << kCellBits | bits(x);
}

std::size_t hashOf(std::uint64_t cell) {
  cell *= 0x9E3779B97F4A7C15ull;
  return std::size_t(cell ^ (cell >> 29));
}

Box boxOf(const ValueSphere& s) {
  return Box{s.centre, s.centre}.expanded(s.radius * 1.00001f);
}

std::vector<RangeTree::Item> rangesOf(std::span<const ValueSphere> spheres) {
  std::vector<RangeTree::Item> items;
  for (const ValueSphere& s : spheres)
    if (s.radius > 0) items.push_back({boxOf(s), Interval::of(s.value)});
  return items;
}

}  // namespace

VertexSpheres::VertexSpheres(std::span<const ValueSphere> spheres) : ranges_(rangesOf(spheres)) {
  Box centres;
  for (const ValueSphere& s : spheres) centres = centres.including(s.centre);
  origin_ = centres.isEmpty() ? Vec3f{} : centres.min;
  const float smallestCell = centres.longestSide() / kMostCells;

  struct Entry {
    int exponent;
    std::uint64_t cell;
    std::uint32_t index;
    auto operator<=>(const Entry&) const = default;
  };
  std::vector<Entry> entries;
  for (std::uint32_t i = 0; i < spheres.size(); ++i) {
    const ValueSphere& s = spheres[i];
    if (!(s.radius > 0)) continue;
    const int exponent = std::ilogb(std::max(2 * s.radius, smallestCell)) + 1;
    const float cellSize = std::ldexp(1.0f, exponent);
    const Vec3f q = (s.centre - origin_) / cellSize;
    const auto along = [](float x) { return std::int64_t(std::floor(x)); };
    entries.push_back({exponent, cellAt(along(q.x), along(q.y), along(q.z)), i});
  }
  std::sort(entries.begin(), entries.end());

  for (std::size_t first = 0; first < entries.size();) {
    std::size_t last = first, cells = 0;
    for (; last < entries.size() && entries[last].exponent == entries[first].exponent; ++last)
      cells += last == first || entries[last].cell != entries[last - 1].cell;
    Level level{std::ldexp(1.0f, entries[first].exponent), std::vector<Slot>(std::bit_ceil(2 * cells))};
    for (std::size_t i = first; i < last; ++i) {
      const Entry& entry = entries[i];
      const ValueSphere& s = spheres[entry.index];
      if (i == first || entry.cell != entries[i - 1].cell) {
        std::size_t slot = hashOf(entry.cell) & (level.slots.size() - 1);
        while (level.slots[slot].cell != 0) slot = (slot + 1) & (level.slots.size() - 1);
        level.slots[slot] = {entry.cell, std::uint32_t(spheres_.size()), 0};
      }
      std::size_t slot = hashOf(entry.cell) & (level.slots.size() - 1);
      while (level.slots[slot].cell != entry.cell) slot = (slot + 1) & (level.slots.size() - 1);
      ++level.slots[slot].count;
      spheres_.push_back({s.centre, s.radius * s.radius, s.value});
    }
    levels_.push_back(std::move(level));
    first = last;
  }
}

const VertexSpheres::Slot* VertexSpheres::find(const Level& level, std::uint64_t cell) const {
  const std::size_t mask = level.slots.size() - 1;
  for (std::size_t slot = hashOf(cell) & mask; level.slots[slot].cell != 0; slot = (slot + 1) & mask)
    if (level.slots[slot].cell == cell) return &level.slots[slot];
  return nullptr;
}

VertexSpheres::Sum VertexSpheres::at(const Vec3f& p) const {
  Sum sum;
  for (const Level& level : levels_) {
    const Vec3f q = (p - origin_) / level.cellSize - Vec3f{0.5f, 0.5f, 0.5f};
    // Nothing reaches a point beyond the grid, and what is not finite stays out of the integers.
    if (!(std::min({q.x, q.y, q.z}) > -2.0f && std::max({q.x, q.y, q.z}) < 2 * kMostCells)) continue;
    const auto x = std::int64_t(std::floor(q.x)), y = std::int64_t(std::floor(q.y)),
               z = std::int64_t(std::floor(q.z));
    for (int i = 0; i < 8; ++i) {
      const Slot* slot = find(level, cellAt(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2)));
      if (!slot) continue;
      for (std::uint32_t s = slot->first; s < slot->first + slot->count; ++s) {
        const Sphere& sphere = spheres_[s];
        const Vec3f away = p - sphere.centre;
        const float squared = dot(away, away);
        if (squared >= sphere.squaredRadius) continue;
        const double inside = 1.0 - double(squared) / double(sphere.squaredRadius);
        const double weight = inside * inside * inside;
        sum.weight += weight;
        sum.weighted += weight * double(sphere.value);
      }
    }
  }
  return sum;
}

}  // namespace nephele::detail
