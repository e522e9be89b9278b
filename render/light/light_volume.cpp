// The sun's way through a volume, in one sweep (notes: "Precomputed Light Transmissivity").
//
// The lattice is the density's own, sheared: with w the index axis that the light is closest to, a node (i,
// j, k) stands at index position (i + s k, j + t k, k), s and t being the light's slopes against w. Its third
// axis then runs exactly along the light, its slices k coincide with the density's, and all nodes of a slice
// lie at the same place within their voxels: a density sample is a mix with constant weights, and the
// integral a running sum down each column, by Simpson's rule. That works for every affine map from index to
// world space, and slopes are at most 1, so cells stay well shaped.
//
// Only bricks of the lattice that a brick with density reaches into are stored. Between them nothing is
// added, so a column jumps from one to the next. Neighbouring bricks repeat the nodes they share, computed by
// the same sums.
//
// Where density begins c curves most: it grows with the square of the way, and where voxels are opaque all
// that is seen lies there. So what is interpolated there is sqrt(c^2 + 2 a c), see bentColumn, which is
// nearly straight. Across the light, c is a sum over slices of densities that are linear between voxels:
// nodes at the place f between them overestimate the mean of a slice by f (1 - f) / 2 times its second
// difference, which the weights of the mix take off.
//
// Columns only grow. What a brick adds at least follows from its smallest density, so that bricks which lie
// in the dark as a whole are known before the sweep: in a thick cloud most of them.
//
// Limits: the column is resolved at the density's own spacing; structure finer than a voxel does not exist
// there.
#include "nephele/render/light/light_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <utility>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/detail/light_slices.h"
#include "nephele/render/volume/trilinear.h"

namespace nephele {

namespace {

// In the table, until bricks are numbered.
constexpr std::int32_t kReached = 1, kDarkBrick = -1;

constexpr int kN = LightVolume::kWidth;  // nodes across a brick
constexpr int kPatch = kN + 5;           // density samples around a brick's slice, half a slice up and down
// The bricks that a row of a patch lies in at most: all their samples are in it.
constexpr int kRowBricks = detail::kSampleRow / BrickGrid::kBrick;
static_assert(kN == detail::kSliceNodes && BrickGrid::kBrick - 1 + kPatch <= detail::kSampleRow);

}  // namespace

/// Density samples of a plane, the first of which stands at (u, v), in rows that begin with a brick.
struct LightVolume::Patch {
  int u = 0, v = 0;
  /// Where it is set, all samples are this, and none is stored.
  std::optional<float> constant = 0.0f;
  bool isEmpty() const { return constant == 0.0f; }
  const float* at(int atU, int atV) const {
    return samples.data() + (atV - v) * detail::kSampleRow + (atU - u) + insideBrick(u);
  }
  /// With a row behind the last, where vectors end.
  alignas(64) std::array<float, (kPatch + 1) * detail::kSampleRow> samples{};
};

/// The density seen along one index axis: (u, v) across, w along.
struct LightVolume::Sweep {
  const BrickGrid& grid;
  /// Null where the grid has its samples.
  const CodedBricks* coded;
  float most;
  int u, v, w;
  float slopeU, slopeV;
  /// World length of a slice along the light, and whether the light is at the upper end of w.
  float step;
  bool fromAbove;
  int sampleStride[3] = {1, BrickGrid::kWidth, BrickGrid::kVolume / BrickGrid::kWidth};

  Sweep(const RenderVolume& volume, const Vec3f& light, float mostDensity)
      : grid(volume.density()), coded(volume.hasSamples() ? nullptr : &volume.coded()), most(mostDensity) {
    w = 0;
    for (int axis = 1; axis != 3; ++axis)
      if (std::fabs(light[axis]) > std::fabs(light[w])) w = axis;
    u = w == 0 ? 1 : 0;
    v = w == 2 ? 1 : 2;
    slopeU = light[u] / light[w];
    slopeV = light[v] / light[w];
    step = 1.0f / std::fabs(light[w]);
    fromAbove = light[w] > 0;
    if (coded) sampleStride[1] = CodedBricks::kRow, sampleStride[2] = CodedBricks::kPlane;
  }

  Vec3i bricks(int bu, int bv, int bw) const {
    Vec3i b;
    b[u] = bu;
    b[v] = bv;
    b[w] = bw;
    return b;
  }

  // What all samples of a patch are, if its bricks are known to hold one value.
  std::optional<float> constantOf(const Patch& patch, int bw) const {
    std::optional<float> constant;
    for (int bv = brickOf(patch.v); bv <= brickOf(patch.v + kPatch - 1); ++bv)
      for (int bu = brickOf(patch.u); bu <= brickOf(patch.u + kPatch - 1); ++bu) {
        const Interval& range = grid.ranges()[std::size_t(grid.poolIndex(bricks(bu, bv, bw)))];
        const float low = std::clamp(range.min, 0.0f, most), high = std::clamp(range.max, 0.0f, most);
        if (low != high || high != constant.value_or(high)) return std::nullopt;
        constant = high;
      }
    return constant;
  }

  // The samples of the plane w = k that the nodes (u0 .. u0 + 8, v0 .. v0 + 8) need, from half a slice
  // before to half a slice behind it. False if all are zero.
  bool load(int u0, int v0, int k, Patch& patch) const {
    patch.u = u0 + int(std::floor(slopeU * float(k))) - 2;
    patch.v = v0 + int(std::floor(slopeV * float(k))) - 2;
    constexpr int size = BrickGrid::kBrick;
    const int bw = brickOf(k), firstU = brickOf(patch.u), from = insideBrick(patch.u);
    patch.constant = constantOf(patch, bw);
    if (patch.constant) return !patch.isEmpty();
    const int alongW =
        w == 0 && coded ? CodedBricks::offsetAlongX(insideBrick(k)) : insideBrick(k) * sampleStride[w];
    float* rows = patch.samples.data();
    for (int v1 = patch.v, vEnd = patch.v + kPatch; v1 < vEnd;) {
      const int bv = brickOf(v1), v2 = std::min(vEnd, (bv + 1) * size);
      std::array<RowSource, kRowBricks> sources;
      for (int n = 0; n <= brickOf(from + kPatch - 1); ++n)
        sources[std::size_t(n)] =
            sourceOf(bricks(firstU + n, bv, bw), alongW + insideBrick(v1) * sampleStride[v]);
      for (int y = 0; v1 != v2; ++v1, ++y)
        for (int n = 0; n != kRowBricks; ++n, rows += size)
          sources[std::size_t(n)].read(y * sampleStride[v], sampleStride[u], rows);
    }
    return true;
  }

  // The samples of a brick in the rows of a patch, of which the first begins with the first of `codes` or
  // `samples`; none of a brick without density.
  struct RowSource {
    const std::int16_t* codes = nullptr;
    const float* samples = nullptr;
    float unit = 0;

    void read(int offset, int stride, float* out) const {
      constexpr int size = BrickGrid::kBrick;
      if (codes && stride == 1) {
        const auto row = CodedBricks::rowOf(codes + offset, unit);
        std::copy_n(row.data(), size, out);
      } else if (codes) {
        for (int x = 0; x != size; ++x)
          out[x] = (float(codes[offset + x * stride]) - CodedBricks::kZero) * unit;
      } else if (samples) {
        for (int x = 0; x != size; ++x) out[x] = samples[offset + x * stride];
      } else {
        std::fill_n(out, size, 0.0f);
      }
    }
  };
  RowSource sourceOf(const Vec3i& brick, int first) const {
    const std::int32_t pool = grid.poolIndex(brick);
    if (!(grid.ranges()[std::size_t(pool)].max > 0)) return {};
    if (!coded) return {.samples = grid.brick(pool) + sampleOffset(0, 0, 0) + first};
    const CodedBricks::Entry& entry = coded->entries()[grid.tableIndex(brick)];
    return {.codes = coded->codes() + entry.first + first, .unit = entry.unit};
  }

  // What any node of a brick of the lattice adds to its column at least, its first nodes at (u0, v0).
  float leastColumn(int u0, int v0, int bw) const {
    // Mixes of four samples by four weigh some of them below 0: by 0.28 in all, see `weights`.
    constexpr float kBelow = 0.28125f;
    const float k0 = float(bw * BrickGrid::kBrick), k1 = k0 + float(BrickGrid::kBrick);
    const auto bricksOf = [&](int first, float slope) {
      const float low = std::min(slope * k0, slope * k1), high = std::max(slope * k0, slope * k1);
      return std::array{brickOf(first + int(std::floor(low)) - 2),
                        brickOf(first + kN + int(std::ceil(high)) + 2)};
    };
    const auto [firstU, lastU] = bricksOf(u0, slopeU);
    const auto [firstV, lastV] = bricksOf(v0, slopeV);
    float low = INFINITY, high = 0;
    for (int bv = firstV; bv <= lastV; ++bv)
      for (int bu = firstU; bu <= lastU; ++bu) {
        const Interval& range = grid.ranges()[std::size_t(grid.poolIndex(bricks(bu, bv, bw)))];
        low = std::min({low, range.min, most});
        high = std::max(high, std::min(range.max, most));
      }
    return std::max(low - kBelow * (high - low), 0.0f) * step * float(BrickGrid::kBrick);
  }

  // What four samples in a row count for at the place f between the middle two: linear interpolation, less
  // what it overestimates on average, f (1 - f) / 2 times the second difference.
  static std::array<float, 4> weights(float f) {
    const float g = 1 - f, most = 0.5f * f * g;
    return {-most * g, g + most * (2 * g - f), f + most * (2 * f - g), -most * f};
  }

  // Densities where the nodes from (u0, v0) on pass w, at most half a slice from the patch.
  void interpolate(const Patch& patch, int u0, int v0, float atW, detail::SliceNodes& out) const {
    if (patch.constant) {
      out.fill(*patch.constant);
      return;
    }
    const float shiftU = slopeU * atW, shiftV = slopeV * atW;
    const float floorU = std::floor(shiftU), floorV = std::floor(shiftV);
    const detail::SliceWeights mix{weights(shiftU - floorU), weights(shiftV - floorV)};
    detail::mixSlice(patch.at(u0 + int(floorU) - 1, v0 + int(floorV) - 1), mix, most, out);
  }
};

LightVolume::LightVolume(const RenderVolume& volume, const Vec3f& towards, const Options& options,
                         const Progress& progress)
    : dark_(options.dark) {
  require(options.dark > 0, fmt::format("light: expected a dark column above 0, got {}", options.dark));
  require(options.most >= 0, fmt::format("light: expected a density of 0 or more, got {}", options.most));
  require(isFinite(towards) && length(towards) > 0,
          "light: the direction towards it must be finite and not zero");
  const BrickGrid& grid = volume.density();
  const Sweep sweep(volume, grid.worldToIndex().linear * normalize(towards), options.most);
  Mat3f shear;
  shear(0, sweep.u) = shear(1, sweep.v) = shear(2, sweep.w) = 1;
  shear(0, sweep.w) = -sweep.slopeU;
  shear(1, sweep.w) = -sweep.slopeV;
  worldToLattice_ = {shear * grid.worldToIndex().linear, shear * grid.worldToIndex().translation};
  values_.assign(kVolume, 0.0f);
  bend_ = 0.5f * std::min(volume.typicalDensity(), options.most) * sweep.step;
  if (volume.isEmpty()) return;

  makeRoom(findBricks(volume, sweep), options.coded);
  std::atomic<std::int32_t> coded = dark_ < INFINITY ? 2 : 1;
  parallelFor(
      std::size_t(brickCount_.x) * brickCount_.y, 4,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t column = begin; column != end; ++column) fillColumn(sweep, column, coded);
      },
      progress);
  if (!options.coded) return;
  coded_.keepFirst(std::size_t(coded));
  coded_.setTable(table_);
}

// Numbers the bricks of the lattice that a density brick reaches: along the light just its own, across as far
// as the shear within it takes. Returns how many there are.
std::int32_t LightVolume::findBricks(const RenderVolume& volume, const Sweep& sweep) {
  const auto reach = [&](const Vec3i& brick, int axis, float slope, int& first, int& last) {
    const float a = -slope * float(brick[sweep.w] * kBrick);
    const float b = -slope * float((brick[sweep.w] + 1) * kBrick);
    // A node more, for interpolation beyond the last voxel, and a little for the rounding of look-ups.
    constexpr float slack = 1.01f;
    first = int(std::floor((float(brick[axis] * kBrick) + std::min(a, b) - slack) / kBrick));
    last = int(std::floor((float((brick[axis] + 1) * kBrick) + std::max(a, b) + slack) / kBrick));
  };
  std::vector<std::array<Vec3i, 2>> reached;
  reached.reserve(volume.occupiedBricks().size());
  Vec3i low{1 << 30, 1 << 30, 1 << 30}, high = -low;
  for (const Vec3i& brick : volume.occupiedBricks()) {
    auto& [first, last] = reached.emplace_back();
    reach(brick, sweep.u, sweep.slopeU, first.x, last.x);
    reach(brick, sweep.v, sweep.slopeV, first.y, last.y);
    first.z = last.z = brick[sweep.w];
    low = min(low, first);
    high = max(high, last);
  }
  firstBrick_ = low;
  brickCount_ = high - low + Vec3i{1, 1, 1};
  table_.assign(std::size_t(brickCount_.x) * brickCount_.y * brickCount_.z, 0);
  for (const auto& [first, last] : reached)
    for (int j = first.y; j <= last.y; ++j)
      for (int i = first.x; i <= last.x; ++i)
        table_[(std::size_t(first.z - low.z) * brickCount_.y + std::size_t(j - low.y)) * brickCount_.x +
               std::size_t(i - low.x)] = kReached;
  const bool hasDark = dark_ < INFINITY;
  if (hasDark) findDark(sweep);
  std::int32_t next = hasDark ? 2 : 1;
  for (std::int32_t& brick : table_)
    if (brick != 0) brick = brick == kDarkBrick ? 1 : next++;
  return next;
}

// With the bricks that hold one value.
void LightVolume::makeRoom(std::int32_t bricks, bool coded) {
  values_ = {};
  if (coded)
    coded_ = CodedBricks(std::size_t(bricks));
  else
    detail::resizeLarge(values_, std::size_t(bricks) * kVolume);
  for (std::int32_t pool = 0; pool != (dark_ < INFINITY ? 2 : 1); ++pool) {
    std::array<float, kVolume> nodes;
    nodes.fill(pool == 0 ? 0.0f : detail::bentColumn(dark_, bend_));
    if (coded)
      coded_.set(pool, nodes.data());
    else
      std::copy(nodes.begin(), nodes.end(), values_.begin() + pool * kVolume);
  }
}

// Marks what lies behind so much density, by the smallest of every brick, that it is dark.
void LightVolume::findDark(const Sweep& sweep) {
  const auto across = std::size_t(brickCount_.x) * std::size_t(brickCount_.y);
  parallelFor(across, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t column = begin; column != end; ++column) {
      float sum = 0;
      for (int n = 0; n != brickCount_.z; ++n) {
        const int w = sweep.fromAbove ? brickCount_.z - 1 - n : n;
        std::int32_t& entry = table_[std::size_t(w) * across + column];
        if (entry == 0) continue;
        if (sum > dark_)
          entry = kDarkBrick;
        else
          sum += sweep.leastColumn((firstBrick_.x + int(column % std::size_t(brickCount_.x))) * kBrick,
                                   (firstBrick_.y + int(column / std::size_t(brickCount_.x))) * kBrick,
                                   firstBrick_.z + w);
      }
    }
  });
}

// Sums the density down one column of bricks, from the light on. Bricks that are coded get their numbers only
// here, so that those of one value, before all density and in the dark behind it, take no memory.
void LightVolume::fillColumn(const Sweep& sweep, std::size_t column, std::atomic<std::int32_t>& coded) {
  const std::size_t across = std::size_t(brickCount_.x) * brickCount_.y;
  const int u0 = (firstBrick_.x + int(column % std::size_t(brickCount_.x))) * kBrick;
  const int v0 = (firstBrick_.y + int(column / std::size_t(brickCount_.x))) * kBrick;
  const int down = sweep.fromAbove ? -1 : 1;
  const auto entryAt = [&](int n) -> std::int32_t& {
    return table_[std::size_t(sweep.fromAbove ? brickCount_.z - 1 - n : n) * across + column];
  };
  const auto poolAt = [&](int n) { return isStored(entryAt(n)) ? entryAt(n) : 0; };
  const float dark = detail::bentColumn(dark_, bend_);
  // Nodes of the brick that is being worked out, before they are coded.
  std::array<float, kVolume> own;
  bool isDark = false;
  const auto codeOwn = [&](std::int32_t& entry) {
    const Interval range = rangeOfSamples(own);
    isDark = range.min > dark;
    entry = isDark ? 1 : range == Interval::of(0) ? 0 : coded++;
    if (isStored(entry)) coded_.set(entry, own.data());
  };
  const auto store = [&](int brick, int inside, const detail::SliceNodes& sum) {
    float* nodes = values_.empty() ? own.data() : values_.data() + std::size_t(poolAt(brick)) * kVolume;
    nodes += (sweep.fromAbove ? kBrick - inside : inside) * kWidth * kWidth;
    detail::storeSlice(sum, bend_, nodes);
    if (inside == kBrick && values_.empty()) codeOwn(entryAt(brick));
  };
  detail::SliceNodes sum{}, after, halfHere, halfNext, kept[2];
  // At a slice and at the next one.
  detail::SliceNodes *density = &kept[0], *nextDensity = &kept[1];
  Patch patches[2];
  Patch *here = &patches[0], *next = &patches[1];
  detail::forEachFilledRun(brickCount_.z, poolAt, [&](int n, int end) {
    // Slices of the bricks n .. end - 1, counted from the light. Outside of such a run there is no density,
    // or no light.
    const int slices = (end - n) * kBrick;
    int k = (firstBrick_.z + (sweep.fromAbove ? brickCount_.z - n : n)) * kBrick;
    sweep.load(u0, v0, k, *here);
    sweep.interpolate(*here, u0, v0, float(k), *density);
    // Behind a dark brick all is dark.
    int finished = n;
    for (int slice = 0; slice <= slices && !isDark; ++slice, k += down) {
      // What the way to the next slice adds.
      if (slice < slices && (sweep.load(u0, v0, k + down, *next) || !here->isEmpty())) {
        const float middle = float(k) + 0.5f * float(down);
        const float end1 = sweep.step * (1.0f / 6), middle1 = sweep.step * (1.0f / 3);
        sweep.interpolate(*here, u0, v0, middle, halfHere);
        sweep.interpolate(*next, u0, v0, middle, halfNext);
        sweep.interpolate(*next, u0, v0, float(k + down), *nextDensity);
        detail::addSlices(end1, *density, *nextDensity, middle1, halfHere, halfNext, after);
      } else {
        after.fill(0.0f);
        nextDensity->fill(0.0f);
      }
      const int brick = n + slice / kBrick, inside = slice % kBrick;
      if (slice > 0 && inside == 0) store(finished++, kBrick, sum);
      if (slice < slices) store(brick, inside, sum);
      detail::addSlice(after, sum);
      std::swap(density, nextDensity);
      std::swap(here, next);
    }
    for (; isDark && finished < end; ++finished) entryAt(finished) = 1;
  });
}

void LightVolume::code() {
  if (!values_.empty()) coded_ = CodedBricks(std::exchange(values_, {}), table_);
}

float LightVolume::columnDensity(const Vec3f& world) const {
  float column = 0;
  columnDensities({&world, 1}, {&column, 1});
  return column;
}

void LightVolume::columnDensities(std::span<const Vec3f> world, std::span<float> columns) const {
  const auto floorOf = [](float x) { return int(x) - (x < float(int(x))); };
  for (std::size_t n = 0; n != world.size(); ++n) {
    const Vec3f p = worldToLattice_(world[n]);
    const Vec3i cell{floorOf(p.x), floorOf(p.y), floorOf(p.z)}, corner = cell - firstBrick_ * kBrick;
    const Vec3i brick{brickOf(corner.x), brickOf(corner.y), brickOf(corner.z)};
    columns[n] = 0.0f;
    if (!BrickBox{{}, brickCount_}.covers(brick)) continue;
    const std::size_t place = BrickBox{{}, brickCount_}.numberOf(brick);
    const Vec3i at = corner - brick * kBrick;
    if (!isStored(table_[place])) {
      columns[n] = table_[place] == 0 ? 0.0f : dark_;
      continue;
    }
    float bent;
    if (coded_.isEmpty())
      bent = trilinear(values_.data() + std::size_t(table_[place]) * kVolume +
                           std::size_t((at.z * kWidth + at.y) * kWidth + at.x),
                       p - Vec3f(cell), kWidth, kWidth * kWidth);
    else {
      // Codes are interpolated as they are: what they stand for is linear in them.
      const CodedBricks::Entry& entry = coded_.entries()[place];
      const std::int16_t* first = coded_.codes() + entry.first + CodedBricks::offsetOf(at);
      bent = (trilinear(p - Vec3f(cell),
                        [first](int x, int y, int z) {
                          return float(first[z * CodedBricks::kPlane + y * CodedBricks::kRow + x]);
                        }) -
              CodedBricks::kZero) *
             entry.unit;
    }
    columns[n] = detail::unbentColumn(bent, bend_);
  }
}

float LightVolume::leastColumnDensity(std::span<const Vec3f> world) const {
  if (!(dark_ < INFINITY)) return 0;
  Box around;
  for (const Vec3f& point : world) around = around.including(worldToLattice_(point));
  Vec3i first, last;
  for (int axis = 0; axis != 3; ++axis) {
    first[axis] = brickOf(int(std::floor(around.min[axis]))) - firstBrick_[axis];
    last[axis] = brickOf(int(std::floor(around.max[axis]))) - firstBrick_[axis];
  }
  const BrickBox box{{}, brickCount_};
  if (!box.covers(first) || !box.covers(last)) return 0;
  for (int z = first.z; z <= last.z; ++z)
    for (int y = first.y; y <= last.y; ++y)
      for (int x = first.x; x <= last.x; ++x)
        if (table_[box.numberOf({x, y, z})] != 1) return 0;
  return dark_;
}

}  // namespace nephele
