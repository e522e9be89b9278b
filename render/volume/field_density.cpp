// Bounds of a field on a lattice.
//
// An octree of ranges over the box, as in baking: what is empty or constant is settled for a whole cell of
// the octree, anything else restricts the expression and is split, down to bricks of 8^3 cells, and within
// these to cells. Bounds of a cell are kept as 2 bytes between those of its brick, rounded outward.
//
// Limits: the table of bricks is dense.
#include "nephele/render/volume/field_density.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/volume/detail/brick_distances.h"

namespace nephele {

namespace {

constexpr double kMostBricks = double(1 << 24);
constexpr int kFarthest = 32;
// Bricks along an edge of the parts that are worked on in parallel, and of those with an expression each.
constexpr int kTask = 8;
constexpr int kRegion = 2;
constexpr float kMostDensity = FieldDensity::kMostDensity;

Interval densities(const Interval& values) {
  return {std::clamp(values.min, 0.0f, kMostDensity), std::clamp(values.max, 0.0f, kMostDensity)};
}

}  // namespace

// What the parts of the octree find; they write to bricks of their own in the tables.
struct FieldDensity::Build {
  struct Task {
    ScalarField field;
    Vec3i brick;
    int size;
  };
  // In the order in which they are found within a task.
  struct Found {
    std::vector<std::size_t> entries;
    std::vector<Cells> cells;
    std::vector<int> fields;
    std::vector<ScalarField> restricted;
    // Working memory.
    std::array<std::vector<float>, 5> lanes;
  };

  FieldDensity& density;
  const Progress& progress;

  Box boxOf(const Vec3i& brick, int size) const { return density.boxOf(brick * kBrick, size * kBrick); }
  // The same with room for the corners that `findFlat` looks at.
  Box around(const Vec3i& brick, int size) const { return density.boxOf(brick * kBrick, size * kBrick, 1); }

  // Settles the bricks from `brick` on if the range of `field` does, and tells whether.
  bool settle(const ScalarField& field, const Vec3i& brick, int size) const {
    const Box box = boxOf(brick, size);
    if (box.isEmpty()) return true;
    const Interval range = densities(field.range(box));
    if (range.max == 0) return true;
    if (!range.isPoint() && size > 1) return false;
    const Vec3i end = min(brick + Vec3i{size, size, size}, density.bricks_);
    for (int z = brick.z; z != end.z; ++z)
      for (int y = brick.y; y != end.y; ++y)
        for (int x = brick.x; x != end.x; ++x) {
          const std::size_t entry = density.entryOf({x, y, z});
          density.ranges_[entry] = range;
          density.emptiness_[entry] = 0;
        }
    return range.isPoint();
  }

  template <class Visit>
  void eachOctant(const Vec3i& brick, int size, Visit&& visit) const {
    const int half = size / 2;
    for (int i = 0; i != 8; ++i) {
      const Vec3i part = brick + Vec3i{i & 1, i >> 1 & 1, i >> 2} * half;
      if (part.x < density.bricks_.x && part.y < density.bricks_.y && part.z < density.bricks_.z)
        visit(part, half);
    }
  }

  void collect(const Task& from, std::vector<Task>& tasks) const {
    if (from.size <= kTask) {
      tasks.push_back(from);
      return;
    }
    progress.check();
    if (settle(from.field, from.brick, from.size)) return;
    const ScalarField here = from.field.restrictedTo(around(from.brick, from.size));
    eachOctant(from.brick, from.size, [&](const Vec3i& brick, int size) {
      collect({here, brick, size}, tasks);
    });
  }

  void run(const Task& task, Found& found) const {
    if (settle(task.field, task.brick, task.size)) return;
    if (task.size == 1) {
      addBrick(task, found);
      return;
    }
    progress.check();
    const ScalarField here =
        task.size >= kRegion ? task.field.restrictedTo(around(task.brick, task.size)) : task.field;
    eachOctant(task.brick, task.size, [&](const Vec3i& brick, int size) { run({here, brick, size}, found); });
  }

  void addBrick(const Task& task, Found& found) const {
    const std::size_t entry = density.entryOf(task.brick);
    found.entries.push_back(entry);
    if (found.restricted.empty() || found.restricted.back().node() != task.field.node())
      found.restricted.push_back(task.field);
    found.fields.push_back(int(found.restricted.size()) - 1);
    addCells(task.field, density.ranges_[entry], task.brick * kBrick, {}, kBrick, found.cells.emplace_back());
    if (density.looksForFlat_) findFlat(task.field, task.brick * kBrick, found);
  }

  // Finds the cells in and around which the density is the same at every half of a cell.
  void findFlat(const ScalarField& field, const Vec3i& first, Found& found) const {
    // Points along an edge, from a cell in front of the brick to one behind it; those that a cell looks at.
    constexpr int n = 2 * (kBrick + 2) + 1, reach = 7, count = n * n * n;
    for (auto& lane : found.lanes) lane.resize(count);
    auto& [x, y, z, low, high] = found.lanes;
    for (int i = 0; i != count; ++i) {
      const Vec3f place = Vec3f(first) + Vec3f(Vec3i{i % n - 2, i / n % n - 2, i / (n * n) - 2}) * 0.5f;
      const Vec3f p = max(min(density.box_.min + place * density.cell_, density.box_.max), density.box_.min);
      const std::size_t at = std::size_t(i);
      x[at] = p.x, y[at] = p.y, z[at] = p.z;
    }
    field.eval({x, y, z}, low);
    for (float& value : low) value = value > 0 ? std::min(value, kMostDensity) : 0.0f;
    high = low;
    // Least and largest of as many points from each one on, along one axis after the other.
    for (const int stride : {1, n, n * n})
      for (int i = 0; i + (reach - 1) * stride < count; ++i)
        for (int k = 1; k != reach; ++k) {
          const std::size_t at = std::size_t(i), other = std::size_t(i + k * stride);
          low[at] = std::min(low[at], low[other]);
          high[at] = std::max(high[at], high[other]);
        }
    Cells& out = found.cells.back();
    for (std::size_t i = 0; i != out.codes.size(); ++i) {
      const int cx = int(i) % kBrick, cy = int(i) / kBrick % kBrick, cz = int(i) / (kBrick * kBrick);
      const std::size_t at = std::size_t(2 * ((cz * n + cy) * n + cx));
      out.isFlat[i] = low[at] == high[at];
    }
  }

  // Bounds of size^3 cells from `cell` of the brick whose first one is `first`.
  void addCells(const ScalarField& field, const Interval& brick, const Vec3i& first, const Vec3i& cell,
                int size, Cells& out) const {
    const Box box = density.boxOf(first + cell, size);
    const Interval range = box.isEmpty() ? Interval::of(0) : densities(field.range(box));
    if (size == 1 || range.max == 0 || range.isPoint()) {
      const Codes codes = codesOf(brick, range);
      for (int z = 0; z != size; ++z)
        for (int y = 0; y != size; ++y)
          for (int x = 0; x != size; ++x)
            out.codes[std::size_t(((cell.z + z) * kBrick + cell.y + y) * kBrick + cell.x + x)] = codes;
      return;
    }
    const int half = size / 2;
    for (int i = 0; i != 8; ++i)
      addCells(field, brick, first, cell + Vec3i{i & 1, i >> 1 & 1, i >> 2} * half, half, out);
  }

  Codes codesOf(const Interval& brick, const Interval& range) const {
    const float unit = (brick.max - brick.min) / 255.0f;
    if (!(unit > 0)) return {0, 255};
    // About, then as close as is still outside.
    int low = int(std::clamp((range.min - brick.min) / unit + 0.5f, 0.0f, 255.0f)),
        high = int(std::clamp((range.max - brick.min) / unit + 0.5f, 0.0f, 255.0f));
    while (low > 0 && density.rangeOf(brick, {std::uint8_t(low), 255}).min > range.min) --low;
    while (high < 255 && density.rangeOf(brick, {0, std::uint8_t(high)}).max < range.max) ++high;
    return {std::uint8_t(low), std::uint8_t(high)};
  }
};

FieldDensity::FieldDensity(const ScalarField& density, const Box& box, float cell, const Progress& progress,
                           bool looksForFlat)
    : box_(box), cell_(cell), perBrick_(1 / (cell * kBrick)), looksForFlat_(looksForFlat), fields_{density} {
  require(!box.isEmpty() && isFinite(box.min) && isFinite(box.max) && box.longestSide() > 0,
          "field density: expected a box that is bounded and not empty");
  require(std::isfinite(cell) && cell > 0,
          fmt::format("field density: expected a cell size > 0, got {}", cell));
  double count = 1;
  for (int axis = 0; axis != 3; ++axis) {
    const double along = std::max(std::ceil(double(box.size()[axis]) / (double(cell) * kBrick)), 1.0);
    count *= along;
    bricks_[axis] = int(std::min(along, kMostBricks));
  }
  require(count <= kMostBricks,
          fmt::format("field density: cells of {} make {:.3g} bricks of the box, expected at most {:.3g}",
                      cell, count, kMostBricks));
  ranges_.assign(std::size_t(count), Interval::of(0));
  pool_.assign(ranges_.size(), -1);
  region_.assign(ranges_.size(), 0);
  emptiness_.assign(ranges_.size(), kFarthest);

  progress.begin("bounds");
  const Build build{*this, progress};
  int size = kTask;
  while (size < std::max({bricks_.x, bricks_.y, bricks_.z})) size *= 2;
  std::vector<Build::Task> tasks;
  build.collect({density, {}, size}, tasks);
  std::vector<Build::Found> found(tasks.size());
  parallelFor(
      tasks.size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i != end; ++i) {
          build.run(tasks[i], found[i]);
          found[i].lanes = {};
        }
      },
      progress);
  for (Build::Found& part : found) {
    for (std::size_t i = 0; i != part.entries.size(); ++i) {
      pool_[part.entries[i]] = std::int32_t(cells_.size() + i);
      region_[part.entries[i]] = std::int32_t(fields_.size()) + part.fields[i];
    }
    cells_.insert(cells_.end(), part.cells.begin(), part.cells.end());
    fields_.insert(fields_.end(), part.restricted.begin(), part.restricted.end());
    part = {};
  }
  isEmpty_ = std::find(emptiness_.begin(), emptiness_.end(), 0) == emptiness_.end();
  detail::spreadDistances(emptiness_, bricks_);
}

Box FieldDensity::boxOf(const Vec3i& firstCell, int cells, int cellsAround) const {
  const Vec3f low = box_.min + Vec3f(firstCell) * cell_;
  const float side = float(cells) * cell_;
  // Rounding of coordinates far from the origin counts as well.
  const Vec3f far = max(Vec3f{} - box_.min, box_.max);
  const float margin = (float(cellsAround) + kMargin) * cell_ + 1e-6f * std::max({far.x, far.y, far.z});
  return Box{low, low + Vec3f{side, side, side}}.expanded(margin).intersection(box_.expanded(margin));
}

Interval FieldDensity::rangeOf(const Interval& brick, const Codes& codes) const {
  const auto value = [&](std::uint8_t code) {
    if (code == 0) return brick.min;
    return code == 255 ? brick.max : brick.min + (brick.max - brick.min) / 255.0f * float(code);
  };
  return {value(codes[0]), value(codes[1])};
}

std::int32_t FieldDensity::regionAt(const Vec3f& point) const {
  const Vec3f at = (point - box_.min) * perBrick_;
  Vec3i brick;
  // Outside of the table the nearest brick does, so that no floor is needed.
  for (int axis = 0; axis != 3; ++axis) brick[axis] = std::clamp(int(at[axis]), 0, bricks_[axis] - 1);
  return region_[entryOf(brick)];
}

std::size_t FieldDensity::memoryBytes() const {
  return ranges_.size() * (sizeof(Interval) + 2 * sizeof(std::int32_t) + 1) + cells_.size() * sizeof(Cells);
}

}  // namespace nephele
