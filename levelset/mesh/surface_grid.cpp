// A field on grids around a surface, finest near it.
//
// A grid holds bricks wherever the surface is within its reach; the next one is twice as coarse and reaches
// twice as far, since what comes from the surface varies less with distance. Bricks over which the range is
// one value are not evaluated: painted masks are mostly that. Everywhere else a grid reads as NaN, which
// tells its node to ask the next coarser one, and the last of them the exact field.
#include "nephele/levelset/mesh/surface_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/levelset/grid/brick_table.h"
#include "nephele/levelset/grid/grid_kernels.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/levelset/grid/lattice.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/constant_node.h"

namespace nephele::detail {

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr int kBrick = BrickGrid::kBrick;

/// The bricks of 8^3 cells of width `h` that come within `band` of the surface, in the order of a grid's
/// table. Cubes of bricks are split as long as they do, so the cost follows the surface.
std::vector<Vec3i> bricksNear(const NearestOnMesh& mesh, float h, float band, const Progress& progress) {
  const Box box = mesh.box().expanded(band);
  const float width = h * kBrick;
  const auto brick = [width](const Vec3f& p) {
    return Vec3i{int(std::floor(p.x / width)), int(std::floor(p.y / width)), int(std::floor(p.z / width))};
  };
  const Vec3i first = brick(box.min), last = brick(box.max);
  int edge = 1;
  while (edge < 16) edge *= 2;
  std::vector<Vec3i> cubes;
  for (int z = first.z; z <= last.z; z += edge)
    for (int y = first.y; y <= last.y; y += edge)
      for (int x = first.x; x <= last.x; x += edge) cubes.push_back({x, y, z});
  while (true) {
    const float half = 0.5f * width * float(edge);
    std::vector<std::uint8_t> isNear(cubes.size());
    parallelFor(cubes.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Vec3f middle = Vec3f(cubes[i]) * width + Vec3f{half, half, half};
        isNear[i] = mesh.nearest(middle, band + 1.74f * half).has_value();
      }
    });
    progress.check();
    std::vector<Vec3i> kept;
    for (std::size_t i = 0; i < cubes.size(); ++i) {
      if (!isNear[i]) continue;
      if (edge == 1) {
        kept.push_back(cubes[i]);
        continue;
      }
      for (int part = 0; part < 8; ++part) {
        const Vec3i side{part & 1, part >> 1 & 1, part >> 2};
        kept.push_back(cubes[i] + side * (edge / 2));
      }
    }
    cubes = std::move(kept);
    if (edge == 1) break;
    edge /= 2;
  }
  std::sort(cubes.begin(), cubes.end(), comesBefore);
  return cubes;
}

/// Evaluates `field` at some stored samples of a brick.
void sampleBrick(const ScalarField& field, float h, const Vec3i& brick, std::span<const int> offsets,
                 float* samples) {
  constexpr int kWidth = BrickGrid::kWidth;
  std::vector<float> lanes(4 * offsets.size());
  const std::size_t n = offsets.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3i at{offsets[i] % kWidth - 1, offsets[i] / kWidth % kWidth - 1,
                   offsets[i] / (kWidth * kWidth) - 1};
    for (int axis = 0; axis < 3; ++axis)
      lanes[std::size_t(axis) * n + i] = float(brick[axis] * kBrick + at[axis]) * h;
  }
  const std::span<float> all(lanes);
  field.eval({all.subspan(0, n), all.subspan(n, n), all.subspan(2 * n, n)}, all.subspan(3 * n, n));
  for (std::size_t i = 0; i < n; ++i) samples[offsets[i]] = lanes[3 * n + i];
}

/// `field` on the bricks near the surface; NaN elsewhere. Where a brick has no neighbour, its border samples
/// come from `beyond`, which is what is read there.
std::shared_ptr<BrickGrid> sampledNear(const ScalarField& field, const ScalarField& beyond,
                                       const NearestOnMesh& mesh, float h, float reach,
                                       const SampleBrick& sample, const Progress& progress) {
  const std::vector<Vec3i> bricks = bricksNear(mesh, h, reach, progress);
  Vec3i first = bricks.front(), last = first;
  for (const Vec3i& b : bricks) {
    first = min(first, b);
    last = max(last, b);
  }
  auto grid =
      std::make_shared<BrickGrid>(Lattice::uniform(h), BrickBox{first, last - first + Vec3i{1, 1, 1}}, kNan);

  // Bricks of one value share one sample brick.
  std::vector<float> constants(bricks.size(), kNan);
  parallelFor(
      bricks.size(), 16,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const Vec3f corner = Vec3f(bricks[i] * kBrick - Vec3i{1, 1, 1}) * h;
          const Interval range = field.range(
              Box{corner, corner}.including(corner + Vec3f{1, 1, 1} * (h * float(BrickGrid::kWidth - 1))));
          if (range.isPoint()) constants[i] = range.min;
        }
      },
      progress);
  std::map<float, std::int32_t> poolOfConstant;
  std::vector<std::size_t> varying;
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    if (std::isnan(constants[i])) {
      varying.push_back(i);
      continue;
    }
    const auto [found, isNew] = poolOfConstant.try_emplace(constants[i], 0);
    if (isNew) found->second = grid->appendConstant(constants[i]);
    grid->place(bricks[i], found->second);
  }
  const std::int32_t firstVarying = grid->append(varying.size());
  for (std::size_t i = 0; i < varying.size(); ++i)
    grid->place(bricks[varying[i]], firstVarying + std::int32_t(i));
  const auto fillConstants = [&] {
    for (const auto& [value, index] : poolOfConstant) {
      std::fill_n(grid->brick(index), BrickGrid::kVolume, value);
      grid->setRange(index, Interval::of(value));
    }
  };

  // Back and forth: each closest point is a tight bound for the next.
  std::vector<int> own;
  const auto turning = [](int i, int row) { return row % 2 == 0 ? i : kBrick - 1 - i; };
  for (int z = 0; z < kBrick; ++z)
    for (int y = 0; y < kBrick; ++y)
      for (int x = 0; x < kBrick; ++x) own.push_back(sampleOffset(turning(x, y), turning(y, z), z));
  const auto poolAt = [&](std::size_t i) { return firstVarying + std::int32_t(i); };
  parallelFor(
      varying.size(), 4,
      [&](std::size_t begin, std::size_t end) {
        std::array<float, kBrick * kBrick * kBrick> values;
        for (std::size_t i = begin; i < end; ++i) {
          float* samples = grid->brick(poolAt(i));
          if (!sample) {
            sampleBrick(field, h, bricks[varying[i]], own, samples);
            continue;
          }
          sample(bricks[varying[i]] * kBrick, h, values);
          for (int s = 0; s < int(values.size()); ++s)
            samples[sampleOffset(s & 7, s >> 3 & 7, s >> 6)] = values[std::size_t(s)];
        }
      },
      progress);
  fillBorders(*grid);
  // The border of a constant that stands at one place was taken for an ordinary one.
  fillConstants();
  // Interpolation stays within a brick, so the border is needed where the neighbour is not there.
  parallelFor(
      varying.size(), 4,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          float* samples = grid->brick(poolAt(i));
          std::vector<int> missing;
          for (int s = 0; s < BrickGrid::kVolume; ++s)
            if (std::isnan(samples[s])) missing.push_back(s);
          if (!missing.empty()) sampleBrick(beyond, h, bricks[varying[i]], missing, samples);
          grid->setRange(poolAt(i), rangeOfBrick(samples));
        }
      },
      progress);
  return grid;
}

/// The grid where it has values, a coarser one or the exact field elsewhere.
class GriddedNode final : public FieldNode<float> {
 public:
  GriddedNode(std::shared_ptr<const BrickGrid> grid, NodePtr<float> elsewhere, const Interval& all)
      : grid_(std::move(grid)), elsewhere_(std::move(elsewhere)), all_(all) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    sampleTrilinear(*grid_, points, values[0]);
    finish(points, values, scratch);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch& scratch) const override {
    sampleTrilinearGrad(*grid_, points, values[0], grads);
    Scratch::Frame frame(scratch);
    const auto [missing, at] = missingPoints(points, values, frame, scratch);
    if (missing.count > 0) {
      const BlockLanes<1> others = frame.lanes<1>();
      const BlockLanes<3> otherGrads = frame.lanes<3>();
      elsewhere_->evalGrad(missing, others, otherGrads, scratch);
      for (int i = 0; i < missing.count; ++i)
        for (std::size_t c = 0; c < 3; ++c) grads[c][at[std::size_t(i)]] = otherGrads[c][i];
    }
    finish(points, values, scratch);
  }
  Interval range(const Box& box, RangeMemo& memo) const override {
    // Interpolation reads no farther than this.
    const Interval near = memo.of(elsewhere_, box.expanded(2 * grid_->voxelSize()));
    if (near.isPoint()) return near;
    constexpr float kRounding = 2e-6f;
    const float beyond = kRounding * near.magnitude();
    return {std::max(near.min - beyond, all_.min), std::min(near.max + beyond, all_.max)};
  }
  NodePtr<float> restricted(Restriction& restriction) const override {
    return constantFrom<float>(range(restriction.box, restriction.memo.ranges));
  }
  float differenceStep() const override { return grid_->voxelSize(); }

 private:
  struct Missing {
    PointBlock points;
    std::array<int, kBlockSize> at;
  };

  /// The points at which the grid has no value.
  Missing missingPoints(const PointBlock& points, const BlockLanes<1>& values, Scratch::Frame& frame,
                        Scratch& scratch) const {
    Missing missing{};
    const BlockLanes<3> xyz = frame.lanes<3>();
    int count = 0;
    for (int i = 0; i < points.count; ++i) {
      if (!std::isnan(values[0][i])) continue;
      xyz[0][count] = points.x[i];
      xyz[1][count] = points.y[i];
      xyz[2][count] = points.z[i];
      missing.at[std::size_t(count++)] = i;
    }
    if (count > 0) missing.points = scratch.pointBlock(xyz, count);
    return missing;
  }

  void finish(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const {
    Scratch::Frame frame(scratch);
    const auto [missing, at] = missingPoints(points, values, frame, scratch);
    if (missing.count > 0) {
      const BlockLanes<1> others = frame.lanes<1>();
      elsewhere_->eval(missing, others, scratch);
      for (int i = 0; i < missing.count; ++i) values[0][at[std::size_t(i)]] = others[0][i];
    }
    // Blends of samples round; NaN stays.
    for (int i = 0; i < points.count; ++i) {
      float& v = values[0][i];
      v = v < all_.min ? all_.min : v > all_.max ? all_.max : v;
    }
  }

  std::shared_ptr<const BrickGrid> grid_;
  NodePtr<float> elsewhere_;
  Interval all_;
};

/// How far from the surface the grid of a level is used: four of its voxels, and whatever its bricks add.
float reachOfGrid(float voxelSize, int level) {
  return 4 * std::ldexp(voxelSize, level);
}

/// The finest grid is the largest table.
void requireTable(const Box& surface, const SurfaceGridOptions& options) {
  const float h = options.voxelSize;
  requireHoldable("surface grid", surface.expanded(std::min(reachOfGrid(h, 0), options.band)), h);
}

}  // namespace

ScalarField griddedNear(const NearestOnMesh& surface, const ScalarField& exact,
                        const SurfaceGridOptions& options, const Progress& progress) {
  requireTable(surface.box(), options);
  NodePtr<float> field = exact.node();
  int coarsest = 0;
  while (reachOfGrid(options.voxelSize, coarsest) < options.band) ++coarsest;
  for (int level = coarsest; level >= 0; --level) {
    const float reach = std::min(reachOfGrid(options.voxelSize, level), options.band);
    field = std::make_shared<GriddedNode>(
        sampledNear(exact, ScalarField(field), surface, std::ldexp(options.voxelSize, level), reach,
                    options.sample, progress),
        field, options.range);
  }
  return ScalarField(field);
}

}  // namespace nephele::detail
