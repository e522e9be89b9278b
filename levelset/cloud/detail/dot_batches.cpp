#include "nephele/levelset/cloud/detail/dot_batches.h"

#include <fmt/format.h>

#include <array>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

namespace {

using detail::BrickSpan;
using detail::floorOf;
using detail::reachOf;
using detail::Splat;

constexpr int kBrick = kBrickSide;
/// Voxels are numbered from -kFarthest to kFarthest along each axis.
constexpr double kFarthest = 1e9;
/// Dots that a thread takes at a time.
constexpr std::size_t kPiece = 1 << 13;

/// Cubic B-spline of support [-2, 2].
float cubicSpline(float x) {
  x = std::abs(x);
  if (x >= 2) return 0;
  const float near = 4 - 6 * x * x + 3 * x * x * x, far = (2 - x) * (2 - x) * (2 - x);
  return x < 1 ? near / 6 : far / 6;
}

constexpr int kMostWeights = 2 * (int(DotVolume::kLargestRadius) + 1);

/// The blur of a dot along one axis: samples of a spline at whole voxels, which sum up to 1.
struct DotKernel {
  explicit DotKernel(float radiusVoxels) : reach(reachOf(radiusVoxels)) {
    float sum = 0;
    for (int i = -reach; i <= reach; ++i) sum += values[i + reach] = cubicSpline(2 * float(i) / radiusVoxels);
    for (int i = 0; i <= 2 * reach; ++i) values[i] /= sum;
  }
  /// Weights of the 2 reach + 2 voxels around a splat that lies `share` beyond a voxel.
  void weights(float share, float* result) const {
    result[0] = (1 - share) * values[0];
    for (int i = 1; i <= 2 * reach; ++i) result[i] = (1 - share) * values[i] + share * values[i - 1];
    result[2 * reach + 1] = share * values[2 * reach];
  }

  int reach;
  float values[kMostWeights];
};

/// Adds to the samples of a brick, x slowest, z fastest: density alone, or density and colour side by side.
template <bool hasColor>
struct BrickSums {
  static constexpr int kChannels = hasColor ? 4 : 1;

  float* samples;

  static void add(float* sample, float amount, const Vec3f& c) {
    sample[0] += amount;
    if constexpr (hasColor)
      for (int i = 0; i < 3; ++i) sample[1 + i] += amount * c[i];
  }

  /// A small dot whose 8 voxels start at `low`, relative to the brick, and which lies `share` beyond.
  void addSmall(const Vec3i& low, const Vec3f& share, float amount, const Vec3f& c) const {
    const auto beside = [](int x) { return unsigned(x + 1) > unsigned(kBrick); };
    if (beside(low.x) || beside(low.y) || beside(low.z)) return;
    const float wx[2] = {1 - share.x, share.x}, wy[2] = {1 - share.y, share.y},
                wz[2] = {1 - share.z, share.z};
    const auto inside = [](int x) { return unsigned(x) < unsigned(kBrick - 1); };
    if (!(inside(low.x) && inside(low.y) && inside(low.z))) return addBox(low, 2, wx, wy, wz, amount, c);
    float* const s = samples + ((low.x * kBrick + low.y) * kBrick + low.z) * kChannels;
    for (int x = 0; x < 2; ++x)
      for (int y = 0; y < 2; ++y) {
        const float w = amount * wx[x] * wy[y];
        float* const pair = s + (x * kBrick + y) * kBrick * kChannels;
        add(pair, w * wz[0], c);
        add(pair + kChannels, w * wz[1], c);
      }
  }

  /// `count` voxels per axis from `low` on, those that lie in the brick.
  void addBox(const Vec3i& low, int count, const float* wx, const float* wy, const float* wz, float amount,
              const Vec3f& c) const {
    const auto first = [](int x) { return std::max(0, -x); };
    const auto last = [count](int x) { return std::min(count, kBrick - x); };
    for (int x = first(low.x); x < last(low.x); ++x)
      for (int y = first(low.y); y < last(low.y); ++y) {
        const float w = amount * wx[x] * wy[y];
        float* const row = samples + ((low.x + x) * kBrick + low.y + y) * kBrick * kChannels;
        for (int z = first(low.z); z < last(low.z); ++z) add(row + (low.z + z) * kChannels, w * wz[z], c);
      }
  }
};

/// At least `count` values, whatever they are; grows rarely.
template <class T>
void makeRoom(std::vector<T>& values, std::size_t count) {
  if (values.size() >= count) return;
  values = {};
  detail::resizeLarge(values, count + count / 4);
}

[[noreturn]] void refuse(std::size_t dot, const std::string& what) {
  throw Error(fmt::format("dots: dot {} {}", dot, what));
}

std::string shown(const Vec3f& v) {
  return fmt::format("{:g},{:g},{:g}", v.x, v.y, v.z);
}

}  // namespace

void DotVolume::Impl::requireSound(const DotSpans& dots) const {
  const float h = options.voxelSize;
  parallelFor(dots.size(), kPiece, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3f& p = dots.positions[i];
      if (!isFinite(p)) refuse(i, "has the position " + shown(p) + ", which must be finite");
      if (!dots.masses.empty() && !(dots.masses[i] >= 0 && std::isfinite(dots.masses[i])))
        refuse(i, fmt::format("has the mass {:g}, which must be >= 0 and finite", dots.masses[i]));
      if (!dots.radii.empty() && !(dots.radii[i] >= 0 && dots.radii[i] <= kLargestRadius * h))
        refuse(i, fmt::format("has the radius {:g}, allowed: 0 to {:g} ({:g} voxels)", dots.radii[i],
                              kLargestRadius * h, kLargestRadius));
      if (!dots.colors.empty() && !isFinite(dots.colors[i]))
        refuse(i, "has the colour " + shown(dots.colors[i]) + ", which must be finite");
      double reach = double(kLargestRadius);
      if (!dots.velocities.empty()) {
        if (!isFinite(dots.velocities[i]))
          refuse(i, "has the velocity " + shown(dots.velocities[i]) + ", which must be finite");
        if (smears(dots)) {
          if (const float way = smearVoxels(dots, i); !(way <= kLongestSmear))
            refuse(i, fmt::format("is smeared over {:g} voxels, allowed: up to {:g}; use a shorter shutter "
                                  "or larger voxels",
                                  way, kLongestSmear));
          reach += double(length(dots.velocities[i])) *
                   double(std::max(std::abs(options.shutterOpen), std::abs(options.shutterClose))) * perIndex;
        }
      }
      const double farthest =
          double(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)})) * perIndex + reach;
      if (!(farthest <= kFarthest))
        refuse(i, fmt::format("at {} is {:g} voxels from the origin, allowed: up to {:g}", shown(p), farthest,
                              kFarthest));
    }
  });
}

void DotVolume::Impl::makeSplats(const DotSpans& dots) {
  splatCount = firstSplat.back();
  if (!smears(dots)) return;
  makeRoom(dotOfSplat, splatCount);
  parallelFor(dots.size(), kPiece, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      std::fill(dotOfSplat.begin() + std::ptrdiff_t(firstSplat[i]),
                dotOfSplat.begin() + std::ptrdiff_t(firstSplat[i + 1]), std::uint32_t(i));
  });
}

/// Counts the entries of every brick and returns the places of bricks that have some, in order.
std::vector<std::size_t> DotVolume::Impl::countEntries(const DotSpans& dots) {
  detail::BrickTable& table = bricks.table();
  const std::size_t pieces = (splatCount + kPiece - 1) / kPiece;
  std::vector<std::vector<std::size_t>> found(pieces);
  const auto count = [&](std::size_t place, std::size_t piece) {
    if (std::atomic_ref(counters[place]).fetch_add(1, std::memory_order_relaxed) == 0)
      found[piece].push_back(place);
  };
  // Bricks without a place get theirs together with their cube, and are counted afterwards.
  struct Missing {
    std::vector<std::size_t> splats;
    std::vector<Vec3i> cubes;
    /// Keeps most cubes from being noted more than once; begins with what is no cube's first brick.
    std::array<Vec3i, 256> noted;
    Missing() { noted.fill({1, 1, 1}); }

    void note(const Vec3i& brick) {
      const Vec3i cube{brick.x & ~7, brick.y & ~7, brick.z & ~7};
      Vec3i& last = noted[std::size_t((cube.x >> 3) + 7 * (cube.y >> 3) + 53 * (cube.z >> 3)) % noted.size()];
      if (last == cube) return;
      cubes.push_back(last = cube);
    }
  };
  std::vector<Missing> missing(pieces);
  parallelFor(pieces, 1, [&](std::size_t piece, std::size_t) {
    const std::size_t end = std::min((piece + 1) * kPiece, splatCount);
    std::vector<std::size_t>& later = missing[piece].splats;
    forEntries(dots, piece * kPiece, end,
               [&](const Vec3i& brick, const Vec3d&, std::size_t splat, auto&&...) {
                 const std::size_t place = table.placeOf(brick);
                 if (place >= detail::BrickTable::kPlaces) return count(place, piece);
                 missing[piece].note(brick);
                 if (later.empty() || later.back() != splat) later.push_back(splat);
               });
  });
  const std::size_t places = table.placeCount();
  for (const Missing& some : missing)
    for (const Vec3i& brick : some.cubes) table.include(brick);
  counters.resize(table.placeCount(), 0);
  parallelFor(pieces, 1, [&](std::size_t piece, std::size_t) {
    for (const std::size_t splat : missing[piece].splats)
      forEntries(dots, splat, splat + 1, [&](const Vec3i& brick, auto&&...) {
        if (const std::size_t place = table.placeOf(brick); place >= places) count(place, piece);
      });
  });
  std::vector<std::size_t> touched;
  std::size_t sum = 0;
  for (const auto& part : found) sum += part.size();
  touched.reserve(sum);
  // Sorting beats a walk over the table where little of it is touched.
  if (sum < counters.size() / 16) {
    for (const auto& part : found) touched.insert(touched.end(), part.begin(), part.end());
    std::sort(touched.begin(), touched.end());
  } else {
    for (std::size_t i = 0; i < counters.size(); ++i)
      if (counters[i] > 0) touched.push_back(i);
  }
  return touched;
}

template <bool hasColor>
void DotVolume::Impl::sumBrick(const DotSpans& dots, std::size_t place, Splat* first, Splat* last) const {
  const auto isBefore = [](const Splat& a, const Splat& b) { return a.number < b.number; };
  if (!std::is_sorted(first, last, isBefore)) std::sort(first, last, isBefore);
  const Vec3d origin(bricks.table().brickAt(place) * kBrick);
  const BrickSums<hasColor> sums{bricks.samples(bricks.table()[place])};
  const bool smeared = smears(dots);
  for (; first != last; ++first) {
    const std::size_t dot = first->dot;
    const Vec3f color = dots.colors.empty() ? Vec3f{1, 1, 1} : dots.colors[dot];
    const Way way = smeared ? wayOf(dots, dot) : Way{};
    const Run run = smeared ? runOf(first->number, dot, way) : Run{0, 1};
    if (reach(dots, dot) == 0) {
      for (std::size_t k = run.begin; k < run.end; ++k) {
        const Vec3f q = k == run.begin ? first->q : Vec3f(way.point(k) - origin);
        const Vec3i voxel = floorOf(q);
        sums.addSmall(voxel, q - Vec3f(voxel), first->density, color);
      }
      continue;
    }
    const DotKernel kernel(radiusVoxels(dots, dot));
    const Vec3i reach{kernel.reach, kernel.reach, kernel.reach};
    float wx[kMostWeights], wy[kMostWeights], wz[kMostWeights];
    for (std::size_t k = run.begin; k < run.end; ++k) {
      const Vec3f q = k == run.begin ? first->q : Vec3f(way.point(k) - origin);
      const Vec3i voxel = floorOf(q);
      kernel.weights(q.x - float(voxel.x), wx);
      kernel.weights(q.y - float(voxel.y), wy);
      kernel.weights(q.z - float(voxel.z), wz);
      sums.addBox(voxel - reach, 2 * kernel.reach + 2, wx, wy, wz, first->density, color);
    }
  }
}

void DotVolume::Impl::addBatch(const DotSpans& dots, const Progress& progress) {
  makeSplats(dots);
  const std::vector<std::size_t> touched = countEntries(dots);
  const std::size_t oldBricks = bricks.count();
  detail::BrickTable& table = bricks.table();
  std::vector<std::size_t> starts(touched.size() + 1, 0);
  for (std::size_t k = 0; k < touched.size(); ++k) {
    starts[k + 1] = starts[k] + counters[touched[k]];
    counters[touched[k]] = std::uint32_t(starts[k]);
    // Its samples are set to 0 by the thread that adds to them first.
    if (table[touched[k]] < 0) bricks.addAt(touched[k]);
  }
  makeRoom(entries, starts.back());
  parallelFor(splatCount, kPiece, [&](std::size_t begin, std::size_t end) {
    forEntries(
        dots, begin, end,
        [&](const Vec3i& b, const Vec3d& q, std::size_t s, std::size_t dot, std::size_t points) {
          const double own = double(dots.masses.empty() ? 1.0f : dots.masses[dot]);
          const float density = float(own * double(perVoxel) / double(points));
          entries[std::atomic_ref(counters[table.placeOf(b)]).fetch_add(1, std::memory_order_relaxed)] = {
              Vec3f(q - Vec3d(b * kBrick)), density, std::uint32_t(dot), std::uint32_t(s)};
        });
  });
  parallelFor(touched.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::int32_t brick = table[touched[k]];
      if (std::size_t(brick) >= oldBricks) std::fill_n(bricks.samples(brick), channels() * kVoxels, 0.0f);
      Splat* const first = entries.data() + starts[k];
      Splat* const last = entries.data() + starts[k + 1];
      if (options.withColor)
        sumBrick<true>(dots, touched[k], first, last);
      else
        sumBrick<false>(dots, touched[k], first, last);
      counters[touched[k]] = 0;
    }
  });
  progress.check();
}

}  // namespace nephele
