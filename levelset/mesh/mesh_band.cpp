// Narrow-band signed distance to a closed triangle mesh.
//
// Triangles are listed per brick of 8^3 samples that the band around them touches; then each brick is worked
// on alone, all its triangles competing for its samples (triangle_kernels.cpp). Magnitudes are exact. The
// sign comes from the pseudo-normal of the nearest feature; samples beyond the band take it from their
// neighbours, constant bricks from the brick before them along x.
//
// Where sheets of the mesh overlap, the nearest one does not tell the sign. It shows: two neighbouring
// samples of opposite sign then lie farther from the surface, together, than from each other, which no
// distance can do. Nothing is returned then.
//
// Cost: triangles times the samples within the band of each; bands of many voxels are the business of
// mesh_distance.cpp.
#include "nephele/levelset/mesh/mesh_band.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>

#include "nephele/levelset/grid/brick_table.h"
#include "nephele/levelset/mesh/triangle_kernels.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
/// Few enough for cancelling to be heard where each triangle matters to thousands of bricks, and the reverse.
constexpr std::size_t kTriangleGrain = 128, kBrickGrain = 4;
/// Excess over 1 voxel of two distances of opposite sign that rounding explains.
constexpr float kSignTolerance = 0.01f;

/// Triangles by the brick they may matter to.
class BrickLists {
 public:
  BrickLists(const SurfaceGeometry& surface, const BandOptions& options, const Progress& progress)
      : surface_(surface),
        perVoxel_(1.0 / options.voxelSize),
        band_(std::max(options.exteriorVoxels, options.interiorVoxels)) {
    measure();
    shapes_.resize(surface.triangleCount());
    std::vector<std::atomic<std::uint32_t>> counts(bricks_.size() + 1);
    parallelFor(
        surface.triangleCount(), kTriangleGrain,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t t = begin; t < end; ++t) {
            shapes_[t] = triangleShape(corner(t, 0), corner(t, 1), corner(t, 2));
            forEachBrick(
                t, [&](std::size_t brick) { counts[brick + 1].fetch_add(1, std::memory_order_relaxed); });
          }
        },
        progress);
    start_.resize(bricks_.size() + 1);
    std::size_t sum = 0;
    for (std::size_t b = 0; b <= bricks_.size(); ++b)
      start_[b] = sum += counts[b].load(std::memory_order_relaxed);
    triangles_.resize(sum);
    for (auto& c : counts) c.store(0, std::memory_order_relaxed);
    parallelFor(
        surface.triangleCount(), kTriangleGrain,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t t = begin; t < end; ++t)
            forEachBrick(t, [&](std::size_t brick) {
              triangles_[start_[brick] + counts[brick].fetch_add(1, std::memory_order_relaxed)] =
                  std::uint32_t(t);
            });
        },
        progress);
  }

  const BrickBox& bricks() const { return bricks_; }
  bool isEmpty(std::size_t brick) const { return start_[brick] == start_[brick + 1]; }
  const TriangleShape* shapes() const { return shapes_.data(); }
  float band() const { return float(band_); }

  /// Corner `i` of a triangle relative to the first sample of the brick at `position`, in voxels.
  Vec3f localCorner(std::size_t triangle, int i, const Vec3i& position) const {
    return Vec3f(corner(triangle, i) - Vec3d(position) * double(kBrick));
  }

  /// The triangles of a brick, near ones first and then by index, so that nothing depends on the threads.
  void place(std::size_t brick, std::vector<PlacedTriangle>& placed) const {
    placed.clear();
    const Vec3i at = bricks_.at(brick);
    for (std::size_t i = start_[brick]; i < start_[brick + 1]; ++i)
      placed.push_back(
          placeTriangle(triangles_[i], shapes_[triangles_[i]], localCorner(triangles_[i], 0, at)));
    std::sort(placed.begin(), placed.end(), [](const PlacedTriangle& a, const PlacedTriangle& b) {
      return a.order != b.order ? a.order < b.order : a.index < b.index;
    });
  }

 private:
  Vec3d corner(std::size_t triangle, int i) const { return surface_.corner(triangle, i) * perVoxel_; }

  static int brickBelow(double voxel) { return int(std::floor(voxel / kBrick)); }

  void measure() {
    Vec3d low(1e300, 1e300, 1e300), high(-1e300, -1e300, -1e300);
    for (std::size_t t = 0; t < surface_.triangleCount(); ++t)
      for (int i = 0; i < 3; ++i) {
        low = min(low, surface_.corner(t, i));
        high = max(high, surface_.corner(t, i));
      }
    low *= perVoxel_;
    high *= perVoxel_;
    const Vec3d size = (high - low) * (1.0 / kBrick) + Vec3d(1, 1, 1) * (band_ / 4 + 4);
    requireHoldable("level set", size.x, size.y, size.z);
    require(std::max({-low.x, -low.y, -low.z, high.x, high.y, high.z}) + band_ < kLargestIndex,
            "level set: the mesh lies too far from the origin for voxels of this size; use larger voxels");
    for (int i = 0; i < 3; ++i) {
      // One brick more on every side: rows start outside.
      bricks_.first[i] = brickBelow(low[i] - band_) - 1;
      bricks_.count[i] = brickBelow(high[i] + band_) + 2 - bricks_.first[i];
    }
  }

  template <class Visit>
  void forEachBrick(std::size_t triangle, const Visit& visit) const {
    const Vec3d a = corner(triangle, 0), b = corner(triangle, 1), c = corner(triangle, 2);
    const Vec3d low = min(a, min(b, c)) - Vec3d(band_, band_, band_),
                high = max(a, max(b, c)) + Vec3d(band_, band_, band_);
    const Vec3d n = normalize(cross(b - a, c - a));
    const double reach = band_ + 0.5 * (kBrick - 1) * (std::abs(n.x) + std::abs(n.y) + std::abs(n.z));
    // The first brick whose last sample is not below `low`, and the last whose first sample is not above
    // `high`.
    const auto firstOf = [](double v) { return brickBelow(std::ceil(v)); };
    for (int z = firstOf(low.z); z <= brickBelow(high.z); ++z)
      for (int y = firstOf(low.y); y <= brickBelow(high.y); ++y)
        for (int x = firstOf(low.x); x <= brickBelow(high.x); ++x) {
          const Vec3d middle = Vec3d(x, y, z) * double(kBrick) + Vec3d(1, 1, 1) * (0.5 * (kBrick - 1));
          if (std::abs(dot(n, middle - a)) > reach) continue;
          visit(bricks_.numberOf({x, y, z}));
        }
  }

  const SurfaceGeometry& surface_;
  double perVoxel_;
  double band_;
  BrickBox bricks_;
  std::vector<TriangleShape> shapes_;
  std::vector<std::size_t> start_;
  std::vector<std::uint32_t> triangles_;
};

/// One bit per sample of a brick: planes of z, bytes of y, bits of x.
struct SampleMask {
  std::array<std::uint64_t, 8> planes{};

  bool any() const {
    return std::any_of(planes.begin(), planes.end(), [](std::uint64_t p) { return p != 0; });
  }
  bool operator==(const SampleMask&) const = default;
};

constexpr std::uint64_t kNotFirstX = 0xfefefefefefefefeull, kNotLastX = 0x7f7f7f7f7f7f7f7full;

/// Samples that are in `m` or beside one that is.
SampleMask grown(const SampleMask& m) {
  SampleMask result;
  for (std::size_t z = 0; z < 8; ++z) {
    const std::uint64_t p = m.planes[z];
    result.planes[z] = p | ((p << 1) & kNotFirstX) | ((p >> 1) & kNotLastX) | (p << 8) | (p >> 8) |
                       (z > 0 ? m.planes[z - 1] : 0) | (z < 7 ? m.planes[z + 1] : 0);
  }
  return result;
}

/// Sides of a brick's samples; all known once spread.
struct Sides {
  SampleMask inside, outside;

  /// Gives the samples on neither side that of their neighbours. False if both sides meet there.
  bool spread() {
    SampleMask open;
    for (std::size_t z = 0; z < 8; ++z) open.planes[z] = ~(inside.planes[z] | outside.planes[z]);
    while (open.any()) {
      const SampleMask in = grown(inside), out = grown(outside);
      for (std::size_t z = 0; z < 8; ++z) {
        if (in.planes[z] & out.planes[z] & open.planes[z]) return false;
        inside.planes[z] |= in.planes[z] & open.planes[z];
        outside.planes[z] |= out.planes[z] & open.planes[z];
        open.planes[z] &= ~(in.planes[z] | out.planes[z]);
      }
    }
    return true;
  }

  bool isInside(int x, int y, int z) const { return inside.planes[std::size_t(z)] >> (y * 8 + x) & 1; }
};

/// False if two neighbouring samples lie on opposite sides and farther from the surface, together, than 1
/// voxel.
bool sidesFit(const Sides& sides, const float* distance) {
  bool fit = true;
  const auto check = [&](std::uint64_t pairs, int z, int step) {
    for (; pairs != 0; pairs &= pairs - 1) {
      const int i = z * 64 + std::countr_zero(pairs);
      fit &= distance[i] + distance[i + step] <= 1.0f + kSignTolerance;
    }
  };
  for (int z = 0; z < 8; ++z) {
    const std::uint64_t p = sides.inside.planes[std::size_t(z)];
    check((p ^ (p >> 1)) & kNotLastX, z, 1);
    check((p ^ (p >> 8)) & ~(std::uint64_t(0xff) << 56), z, 8);
    if (z < 7) check(p ^ sides.inside.planes[std::size_t(z) + 1], z, 64);
  }
  return fit;
}

/// What the work on one brick leaves.
enum class BlockState { empty, done, contradictory };

BlockState workBrick(const BrickLists& lists, const SurfaceGeometry& surface, const BandOptions& options,
                     std::size_t brick, std::vector<PlacedTriangle>& placed, float* values) {
  NearestSamples nearest;
  std::fill_n(nearest.squared, NearestSamples::kSize, lists.band() * lists.band());
  std::fill_n(nearest.code, NearestSamples::kSize, -1);
  lists.place(brick, placed);
  nearestTriangles(lists.shapes(), placed.data(), placed.size(), lists.band(), nearest);

  const Vec3i at = lists.bricks().at(brick);
  Sides sides;
  bool any = false;
  for (int i = 0; i < NearestSamples::kSize; ++i) {
    const std::int32_t code = nearest.code[i];
    if (code < 0) continue;
    any = true;
    // A corner of the feature serves as its point: pseudo-normals of sides are at right angles to them.
    constexpr int kCornerOf[7] = {0, 0, 1, 2, 0, 1, 2};
    const auto triangle = std::size_t(code / 8);
    const int feature = code % 8;
    const Vec3f p(float(i % 8), float(i / 8 % 8), float(i / 64));
    const Vec3f away = p - lists.localCorner(triangle, kCornerOf[feature], at);
    const bool inside = dot(away, surface.normals[triangle][std::size_t(feature)]) < 0;
    (inside ? sides.inside : sides.outside).planes[std::size_t(i / 64)] |= std::uint64_t(1) << (i % 64);
  }
  if (!any) return BlockState::empty;

  float distance[NearestSamples::kSize];
  for (int i = 0; i < NearestSamples::kSize; ++i) distance[i] = std::sqrt(nearest.squared[i]);
  if (!sides.spread() || !sidesFit(sides, distance)) return BlockState::contradictory;
  const auto voxel = float(options.voxelSize);
  const float low = options.outsideValue(), high = options.insideValue();
  for (int i = 0; i < NearestSamples::kSize; ++i) {
    const bool inside = sides.inside.planes[std::size_t(i / 64)] >> (i % 64) & 1;
    values[i] = inside ? std::min(distance[i] * voxel, high) : std::max(-distance[i] * voxel, low);
    // Beyond the band nothing was measured.
    if (nearest.code[i] < 0) values[i] = inside ? high : low;
  }
  return BlockState::done;
}

bool isInsideValue(float value) {
  return value > 0;
}

/// What stands at each brick position: kOutside, kInside or the number of a brick with samples.
using Entries = std::vector<std::int32_t>;
constexpr std::int32_t kOutside = -1, kInside = -2;

/// Sets constant bricks from the bricks before them along x. False if the sides do not fit.
bool fillConstants(const VoxelGrid<float>& band, std::size_t rowLength, const std::vector<BlockState>& states,
                   Entries& entries) {
  std::atomic<bool> fit{true};
  parallelFor(entries.size() / rowLength, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      std::int32_t side = kOutside;
      bool afterConstant = true;
      for (std::size_t x = 0; x < rowLength; ++x) {
        std::int32_t& entry = entries[row * rowLength + x];
        if (entry < 0 || states[std::size_t(entry)] == BlockState::empty) {
          entry = side;
          afterConstant = true;
          continue;
        }
        const float* samples = band.samples(entry);
        if (afterConstant && isInsideValue(samples[0]) != (side == kInside)) fit = false;
        side = isInsideValue(samples[kBrick - 1]) ? kInside : kOutside;
        afterConstant = false;
      }
      if (side != kOutside) fit = false;
    }
  });
  return fit;
}

}  // namespace

std::optional<VoxelGrid<float>> signedBand(const SurfaceGeometry& surface, const BandOptions& options,
                                           const Progress& progress) {
  if (!surface.manifold) return std::nullopt;
  require(surface.triangleCount() < std::size_t(std::numeric_limits<std::int32_t>::max()) / 8,
          "level set: the mesh has more triangles than can be numbered");
  const BrickLists lists(surface, options, progress);
  const BrickBox& box = lists.bricks();
  VoxelGrid<float> band("level set", options.voxelSize, options.outsideValue());
  Entries entries(box.size(), kOutside);
  std::vector<std::size_t> bricks;
  for (std::size_t b = 0; b < entries.size(); ++b)
    if (!lists.isEmpty(b)) {
      entries[b] = std::int32_t(bricks.size());
      bricks.push_back(b);
      band.add(box.at(b));
    }
  std::vector<BlockState> states(bricks.size());
  std::atomic<bool> contradiction{false};
  parallelFor(
      bricks.size(), kBrickGrain,
      [&](std::size_t begin, std::size_t end) {
        std::vector<PlacedTriangle> placed;
        for (std::size_t i = begin; i < end && !contradiction; ++i) {
          states[i] = workBrick(lists, surface, options, bricks[i], placed, band.samples(std::int32_t(i)));
          if (states[i] == BlockState::contradictory) contradiction = true;
        }
      },
      progress);
  if (contradiction || !fillConstants(band, std::size_t(box.count.x), states, entries)) return std::nullopt;
  for (std::size_t b = 0; b < entries.size(); ++b)
    if (entries[b] == kInside || (entries[b] == kOutside && !lists.isEmpty(b)))
      band.setConstant(box.at(b), entries[b] == kInside ? options.insideValue() : options.outsideValue());
  return band;
}

}  // namespace nephele::detail
