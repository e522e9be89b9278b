// Dots of any size and any smear become points in index space with a mass, which are added to voxels with
// trilinear weights, blurred by a discrete kernel where a dot is larger than a voxel. Trilinear weights
// sum up to 1 and have their centroid at the splat, and a symmetric kernel keeps both.
//
// The points of a smeared dot are sorted in runs of four voxels: a brick adds those of a run that it holds.
//
// A batch of splats is sorted by brick: a splat has an entry in every brick that it touches (1.4 on average).
// Counting and placing entries use atomic counters beside the numbers of a sparse table of bricks; each brick
// then sorts its entries by number, which makes the order that of the input whatever the threads did, and
// adds them up, alone.
//
// Places are computed in double precision, from the dots each time that they are asked for, and kept in
// single precision only relative to a brick: a dot lands in the right voxel however far from the origin it
// lies.
//
// Source: Tessendorf, Production Volume Rendering (2008), "Baking anti-aliased dots".
// Limits: sums are single precision, so a voxel that collects n dots is off by some sqrt(n) roundings.
#include "nephele/levelset/cloud/dot_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/levelset/grid/sparse_bricks.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

constexpr int kBrick = kBrickSide;
constexpr std::size_t kVoxels = std::size_t(kBrick) * kBrick * kBrick;
/// Voxels are numbered from -kFarthest to kFarthest along each axis.
constexpr double kFarthest = 1e9;
/// Entries (of splats in bricks) that are sorted at a time, on average.
constexpr double kBatch = double(1 << 20);
/// Points of a smeared dot that are sorted as one, two per voxel.
constexpr std::size_t kRun = 8;
/// Dots that a thread takes at a time.
constexpr std::size_t kPiece = 1 << 13;

/// A dot at rest, or a part of the way of one that is smeared, in a brick that it touches.
struct Splat {
  Vec3f q;        ///< Index space, from the brick's first voxel; of a smeared dot, where the part begins.
  float density;  ///< Of each of its points.
  std::uint32_t dot;
  std::uint32_t number;  ///< In the order in which splats are added.
};

/// Voxels beyond the 8 nearest that a dot reaches on each side.
int reachOf(float radiusVoxels) {
  return radiusVoxels > 1 ? int(std::ceil(radiusVoxels)) - 1 : 0;
}

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

/// The bricks that a splat touches, both included.
struct BrickSpan {
  Vec3i first, last;

  template <class Body>
  void forEach(const Body& body) const {
    if (first == last) return body(first);
    for (int z = first.z; z <= last.z; ++z)
      for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x) body(Vec3i{x, y, z});
  }
};

/// Without a call of std::floor, which needs instructions that not every machine has.
template <class Real>
Vec3i floorOf(const Vec3<Real>& q) {
  const auto along = [](Real x) {
    const int whole = int(x);
    return whole - int(x < Real(whole));
  };
  return {along(q.x), along(q.y), along(q.z)};
}

BrickSpan bricksOf(const Vec3d& q, int reach) {
  const Vec3i low = floorOf(q), r{reach, reach, reach};
  return {brickOf(low - r), brickOf(low + r + Vec3i{1, 1, 1})};
}

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

struct DotVolume::Impl {
  DotVolumeOptions options;
  double perIndex = 1;  ///< 1 / edge of a voxel.
  float perVoxel = 1;   ///< 1 / volume of a voxel.
  float ownRadius = 0;  ///< Of dots that bring none, voxels.
  int ownReach = 0;
  std::uint64_t dotCount = 0;
  double mass = 0;

  detail::SparseBricks<float> bricks;
  std::vector<std::uint32_t> counters;  ///< Per place of the bricks' table: all 0 between batches.

  // Working memory of a batch.
  std::vector<std::size_t> firstSplat;    ///< Of each dot, and after the last.
  std::vector<std::uint32_t> dotOfSplat;  ///< Where dots are smeared; else each is one splat.
  std::size_t splatCount = 0;
  std::vector<Splat> entries;

  explicit Impl(const DotVolumeOptions& o)
      : options(o), perIndex(1.0 / double(o.voxelSize)), bricks("dots", (o.withColor ? 4 : 1) * kVoxels) {}

  std::size_t channels() const { return options.withColor ? 4 : 1; }

  float radiusVoxels(const DotSpans& dots, std::size_t i) const {
    return dots.radii.empty() ? ownRadius : dots.radii[i] / options.voxelSize;
  }
  int reach(const DotSpans& dots, std::size_t i) const {
    return dots.radii.empty() ? ownReach : reachOf(dots.radii[i] / options.voxelSize);
  }
  bool smears(const DotSpans& dots) const {
    return !dots.velocities.empty() && (options.shutterOpen != 0 || options.shutterClose != 0);
  }
  /// Way of a dot while the shutter is open, voxels.
  float smearVoxels(const DotSpans& dots, std::size_t i) const {
    return length(dots.velocities[i]) * (options.shutterClose - options.shutterOpen) / options.voxelSize;
  }
  /// Points that a smeared dot is the sum of: two Gauss-Legendre points in each of some equal pieces.
  std::size_t pointsOf(const DotSpans& dots, std::size_t i) const {
    if (!smears(dots)) return 1;
    const float way = smearVoxels(dots, i);
    return way > 0 ? 2 * std::size_t(std::ceil(way)) : 1;
  }
  /// Where those points are, index space.
  struct Way {
    Vec3d start, step;
    std::size_t count;

    Vec3d point(std::size_t k) const {
      constexpr double kSide = 0.5 * std::numbers::inv_sqrt3;
      const double place = double(k / 2) + 0.5 + (count == 1 ? 0 : k % 2 ? kSide : -kSide);
      return start + step * place;
    }
  };
  Way wayOf(const DotSpans& dots, std::size_t i) const {
    Way way{Vec3d(dots.positions[i]) * perIndex, {}, pointsOf(dots, i)};
    if (!smears(dots)) return way;
    const Vec3d v = Vec3d(dots.velocities[i]) * perIndex;
    const double open = double(options.shutterOpen), close = double(options.shutterClose);
    way.start += v * open;
    way.step = v * ((close - open) / (way.count == 1 ? 1.0 : double(way.count / 2)));
    return way;
  }
  /// The points [begin, end) of a dot, which a splat stands for.
  struct Run {
    std::size_t begin, end;
  };
  Run runOf(std::size_t splat, std::size_t dot, const Way& way) const {
    const std::size_t begin = (splat - firstSplat[dot]) * kRun;
    return {begin, std::min(begin + kRun, way.count)};
  }
  /// The bricks that a splat touches, and some more if it is smeared aslant.
  BrickSpan bricksAt(const DotSpans& dots, std::size_t dot, const Way& way, const Run& run) const {
    const int extent = reach(dots, dot);
    const BrickSpan span = bricksOf(way.point(run.begin), extent);
    if (run.end - run.begin < 2) return span;
    const BrickSpan last = bricksOf(way.point(run.end - 1), extent);
    return {min(span.first, last.first), max(span.last, last.last)};
  }
  /// visit(brick, q, splat, dot, points) for every brick that each of some splats touches, q being where it
  /// begins.
  template <class Visit>
  void forEntries(const DotSpans& dots, std::size_t begin, std::size_t end, const Visit& visit) const {
    const bool smeared = smears(dots);
    for (std::size_t s = begin; s < end; ++s) {
      if (!smeared) {
        const Vec3d q = Vec3d(dots.positions[s]) * perIndex;
        bricksOf(q, reach(dots, s)).forEach([&](const Vec3i& brick) { visit(brick, q, s, s, 1); });
        continue;
      }
      const std::size_t dot = dotOfSplat[s];
      const Way way = wayOf(dots, dot);
      const Run run = runOf(s, dot, way);
      bricksAt(dots, dot, way, run).forEach([&](const Vec3i& brick) {
        visit(brick, way.point(run.begin), s, dot, way.count);
      });
    }
  }

  /// visit(brick, number), in the order of the numbers.
  template <class Visit>
  void forEachNumber(const Visit& visit) const {
    const detail::BrickTable& table = bricks.table();
    std::vector<Vec3i> positions(bricks.count());
    for (std::size_t place = detail::BrickTable::kPlaces; place < table.placeCount(); ++place)
      if (table[place] >= 0) positions[std::size_t(table[place])] = table.brickAt(place);
    for (std::size_t i = 0; i < positions.size(); ++i) visit(positions[i], std::int32_t(i));
  }
  const float* sampleAt(const Vec3i& voxel) const;
  void requireSound(const DotSpans& dots) const;
  void addBatch(const DotSpans& dots, const Progress& progress);
  void makeSplats(const DotSpans& dots);
  std::vector<std::size_t> countEntries(const DotSpans& dots);
  template <bool hasColor>
  void sumBrick(const DotSpans& dots, std::size_t place, Splat* first, Splat* last) const;
};

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

DotVolume::DotVolume(const DotVolumeOptions& o) : impl_(std::make_unique<Impl>(o)) {
  require(o.voxelSize > 0 && std::isfinite(o.voxelSize),
          fmt::format("dots: voxelSize must be > 0 and finite, got {:g}", o.voxelSize));
  require(o.radius >= 0 && o.radius <= kLargestRadius * o.voxelSize,
          fmt::format("dots: radius must be from 0 to {:g} ({:g} voxels), got {:g}",
                      kLargestRadius * o.voxelSize, kLargestRadius, o.radius));
  require(std::isfinite(o.shutterOpen) && std::isfinite(o.shutterClose) && o.shutterOpen <= o.shutterClose,
          fmt::format("dots: the shutter must open before it closes, both finite, got {:g} and {:g}",
                      o.shutterOpen, o.shutterClose));
  impl_->ownRadius = o.radius / o.voxelSize;
  impl_->ownReach = reachOf(impl_->ownRadius);
  impl_->perVoxel = float(1 / (double(o.voxelSize) * double(o.voxelSize) * double(o.voxelSize)));
}

DotVolume::~DotVolume() = default;
DotVolume::DotVolume(DotVolume&&) noexcept = default;
DotVolume& DotVolume::operator=(DotVolume&&) noexcept = default;

void DotVolume::add(const DotSpans& dots, const Progress& progress) {
  dots.requireFit("dots");
  impl_->requireSound(dots);
  std::vector<std::size_t>& firstSplat = impl_->firstSplat;
  for (std::size_t begin = 0; begin < dots.size();) {
    firstSplat.assign(1, 0);
    double entries = 0;
    std::size_t end = begin;
    for (; end < dots.size() && entries < kBatch; ++end) {
      const std::size_t count = (impl_->pointsOf(dots, end) + kRun - 1) / kRun;
      const double wide = 2.0 * impl_->reach(dots, end) + (count > 1 ? 1 + double(kRun) / 4 : 1);
      const double bricks = 1 + wide / kBrick;
      firstSplat.push_back(firstSplat.back() + count);
      entries += double(count) * bricks * bricks * bricks;
    }
    impl_->addBatch(dots.part(begin, end - begin), progress);
    progress.advance(double(end) / double(dots.size()));
    begin = end;
  }
  impl_->dotCount += dots.size();
  for (const float mass : dots.masses) impl_->mass += double(mass);
  if (dots.masses.empty()) impl_->mass += double(dots.size());
}

const float* DotVolume::Impl::sampleAt(const Vec3i& voxel) const {
  const float* const own = bricks.find(brickOf(voxel));
  if (!own) return nullptr;
  const int i = (insideBrick(voxel.x) * kBrick + insideBrick(voxel.y)) * kBrick + insideBrick(voxel.z);
  return own + std::size_t(i) * channels();
}

float DotVolume::density(const Vec3i& voxel) const {
  const float* const sample = impl_->sampleAt(voxel);
  return sample ? sample[0] : 0;
}

Vec3f DotVolume::color(const Vec3i& voxel) const {
  const float* const sample = impl_->sampleAt(voxel);
  if (!impl_->options.withColor || !sample || !(sample[0] > 0)) return {};
  return Vec3f{sample[1], sample[2], sample[3]} / sample[0];
}

std::uint64_t DotVolume::dotCount() const {
  return impl_->dotCount;
}

double DotVolume::mass() const {
  return impl_->mass;
}

std::size_t DotVolume::brickCount() const {
  return impl_->bricks.count();
}

std::size_t DotVolume::memoryBytes() const {
  const std::size_t grids = impl_->bricks.count() * impl_->bricks.samplesPerBrick() * sizeof(float);
  return impl_->bricks.memoryBytes() + grids + impl_->counters.capacity() * sizeof(std::uint32_t) +
         impl_->dotOfSplat.capacity() * sizeof(std::uint32_t) + impl_->entries.capacity() * sizeof(Splat);
}

namespace {

/// Colours of one brick, x fastest: sums over density, and the mean where there is none.
void fillColors(const float* samples, const Vec3f& mean, Vec3f* colors) {
  for (int z = 0; z < kBrick; ++z)
    for (int y = 0; y < kBrick; ++y)
      for (int x = 0; x < kBrick; ++x, ++colors) {
        const float* const s = samples + 4 * ((x * kBrick + y) * kBrick + z);
        *colors = s[0] > 0 ? Vec3f{s[1] / s[0], s[2] / s[0], s[3] / s[0]} : mean;
      }
}

/// The mean colour of a brick, or nothing if it has none.
std::optional<Vec3f> meanColor(const float* samples) {
  double sum[4] = {};
  for (std::size_t v = 0; v < kVoxels; ++v)
    for (std::size_t c = 0; c < 4; ++c) sum[c] += double(samples[4 * v + c]);
  if (!(sum[0] > 0)) return std::nullopt;
  return Vec3f{float(sum[1] / sum[0]), float(sum[2] / sum[0]), float(sum[3] / sum[0])};
}

}  // namespace

VoxelGrid<float> DotVolume::densityGrid() const {
  VoxelGrid<float> grid("dots", double(impl_->options.voxelSize), 0.0f);
  impl_->forEachNumber([&](const Vec3i& brick, std::int32_t) { grid.add(brick); });
  const std::size_t channels = impl_->channels();
  parallelFor(impl_->bricks.count(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const float* const samples = impl_->bricks.samples(std::int32_t(i));
      float* target = grid.samples(std::int32_t(i));
      for (int z = 0; z < kBrick; ++z)
        for (int y = 0; y < kBrick; ++y)
          for (int x = 0; x < kBrick; ++x)
            *target++ = samples[std::size_t((x * kBrick + y) * kBrick + z) * channels];
    }
  });
  return grid;
}

VoxelGrid<Vec3f> DotVolume::colorGrid() const {
  require(impl_->options.withColor, "dots: no colours are kept");
  std::vector<std::optional<Vec3f>> means(impl_->bricks.count());
  parallelFor(means.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) means[i] = meanColor(impl_->bricks.samples(std::int32_t(i)));
  });
  VoxelGrid<Vec3f> grid("dots", double(impl_->options.voxelSize), Vec3f{});
  std::vector<std::size_t> numbers;
  impl_->forEachNumber([&](const Vec3i& brick, std::int32_t number) {
    if (!means[std::size_t(number)]) return;
    grid.add(brick);
    numbers.push_back(std::size_t(number));
  });
  parallelFor(numbers.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      fillColors(impl_->bricks.samples(std::int32_t(numbers[i])), *means[numbers[i]],
                 grid.samples(std::int32_t(i)));
  });
  return grid;
}

double estimatedDotVolumeBytes(const Box& box, double brickCount, double dotCount,
                               const DotVolumeOptions& options) {
  // What the table has for one place, for the cubes of 8^3 places that hold bricks: mostly surfaces.
  constexpr double kPlace = sizeof(std::int32_t) + sizeof(std::uint32_t), kCube = 8;
  const double edge = double(options.voxelSize) * kBrick;
  double positions = 1;
  for (int axis = 0; axis < 3; ++axis) positions *= double(box.size()[axis]) / edge + 2 * kCube;
  const double samples = double(kVoxels) * sizeof(float) * (options.withColor ? 4 : 1);
  const double bricks = std::min(brickCount, positions);
  const double places = std::min(positions, brickCount * kCube * kCube * kCube);
  // Samples here and in the grids; a table with two numbers, and a colour's leaf; a batch.
  return 2 * bricks * samples + places * (kPlace + (options.withColor ? 8 : 0)) +
         std::min(dotCount, kBatch) * 3 * double(sizeof(Splat));
}

}  // namespace nephele
