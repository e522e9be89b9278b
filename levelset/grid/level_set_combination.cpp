#include "nephele/levelset/grid/level_set_combination.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

using Values = std::array<float, kBrickSamples>;

/// As OpenVDB sorts them.
std::vector<Vec3i> bricksOf(std::span<const VoxelGrid<float>> solids) {
  std::set<std::array<int, 3>> all;
  for (const VoxelGrid<float>& solid : solids)
    solid.forEachBrick([&](const Vec3i& brick, std::int32_t entry) {
      if (entry != -1) all.insert({brick.z, brick.y, brick.x});
    });
  std::vector<Vec3i> bricks;
  for (const auto& [z, y, x] : all) bricks.push_back({x, y, z});
  return bricks;
}

class Combiner {
 public:
  Combiner(std::span<const VoxelGrid<float>> solids, const CombinationOptions& options)
      : solids_(solids), options_(options) {}

  Values valuesAt(const Vec3i& brick) const {
    Values all;
    read(solids_[0], brick, all);
    Values next;
    for (const VoxelGrid<float>& solid : solids_.subspan(1)) {
      read(solid, brick, next);
      for (std::size_t i = 0; i < all.size(); ++i) all[i] = joined(all[i], next[i]);
    }
    for (float& value : all) value = std::clamp(value, -options_.halfWidth, options_.halfWidth);
    return all;
  }

 private:
  static void read(const VoxelGrid<float>& solid, const Vec3i& brick, Values& values) {
    const std::int32_t entry = solid.entryAt(brick);
    if (entry >= 0)
      std::copy_n(solid.samples(entry), values.size(), values.begin());
    else
      values.fill(solid.constants()[std::size_t(-1 - entry)]);
  }

  float joined(float a, float b) const {
    if (options_.combination == Combination::unionOf) return larger(a, b);
    return -larger(-a, options_.combination == Combination::cutout ? b : -b);
  }

  float larger(float a, float b) const {
    const float most = std::max(a, b), w = options_.blend;
    const float h = w - std::abs(a - b);
    return w > 0 && h > 0 ? most + h * h / (4 * w) : most;
  }

  std::span<const VoxelGrid<float>> solids_;
  CombinationOptions options_;
};

}  // namespace

VoxelGrid<float> combined(std::span<const VoxelGrid<float>> solids, const CombinationOptions& options,
                          const Progress& progress) {
  require(!solids.empty(), "combination: there must be at least one solid");
  require(options.halfWidth > 0 && std::isfinite(options.halfWidth),
          fmt::format("combination: halfWidth must be > 0 and finite, got {}", options.halfWidth));
  require(options.blend >= 0 && std::isfinite(options.blend),
          fmt::format("combination: blend must be >= 0 and finite, got {}", options.blend));
  const Affine& lattice = solids[0].lattice().indexToWorld;
  for (const VoxelGrid<float>& solid : solids) {
    const Affine& other = solid.lattice().indexToWorld;
    require(other({0, 0, 0}) == lattice({0, 0, 0}) && other({1, 1, 1}) == lattice({1, 1, 1}) &&
                other({1, 0, 0}) == lattice({1, 0, 0}) && other({0, 1, 0}) == lattice({0, 1, 0}),
            "combination: the solids are on different lattices");
  }
  progress.begin("combine");
  const std::vector<Vec3i> bricks = bricksOf(solids);
  const Combiner combiner(solids, options);
  VoxelGrid<float> result("combination", solids[0].lattice(), -options.halfWidth);
  constexpr std::size_t kTogether = 8192;
  std::vector<Values> values(std::min(kTogether, bricks.size()));
  for (std::size_t first = 0; first < bricks.size(); first += kTogether) {
    const std::size_t count = std::min(kTogether, bricks.size() - first);
    parallelFor(
        count, 64,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) values[i] = combiner.valuesAt(bricks[first + i]);
        },
        silent());
    for (std::size_t i = 0; i < count; ++i) {
      const auto isAll = [&](float value) {
        return std::ranges::all_of(values[i], [&](float v) { return v == value; });
      };
      if (isAll(-options.halfWidth)) continue;
      if (isAll(options.halfWidth))
        result.setConstant(bricks[first + i], options.halfWidth);
      else
        std::ranges::copy(values[i], result.add(bricks[first + i]));
    }
    progress.check();
    progress.advance(double(first + count) / double(bricks.size()));
  }
  return result;
}

}  // namespace nephele
