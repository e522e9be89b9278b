// Marching cubes on bricks (Lorensen and Cline 1987), with the faces that its original tables leave open
// decided by the saddle of the bilinear interpolant on the face (Nielson and Hamann 1991);
// detail/marching_cubes_table.cpp makes the triangles.
//
// A brick owns its 8^3 cells and the grid edges that start at its samples. The first pass finds the bricks
// that the surface crosses and counts their vertices and triangles; running sums then give every brick its
// place in the mesh, and the second pass writes without locks, in the same order at any thread count. A
// vertex is numbered by counting bits in its brick's masks of crossed edges, so that no hash table is needed
// and memory follows the surface.
//
// Bricks with a constant value are shared and have no border of their own; hence all samples are read through
// the table. One layer of bricks before the table is visited too: its last cells lie between the background
// and the table.
//
// Limit: two sheets of a surface that a cell joins by a tunnel come out separate (both closed).
#include "nephele/levelset/mesh/marching_cubes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/levelset/mesh/detail/marching_cubes_table.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/printable.h"

namespace nephele {
namespace {

using detail::CellTable;

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kSide = kBrick + 1;
constexpr int kStride[3] = {1, kSide, kSide* kSide};

// A vertex keeps this distance from both ends of its edge, in voxels: twice the spacing of single precision
// at 1000 voxels from the origin, so that vertices about one sample stay apart in files too.
constexpr double kMargin = 1.0 / 4096;

// The corners of a brick's cells.
using Samples = std::array<float, kSide * kSide * kSide>;
// Inside bits of a row of 9 samples, per z and y.
using SignRows = std::array<std::array<std::uint16_t, kSide>, kSide>;

int sampleIndex(int x, int y, int z) {
  return (z * kSide + y) * kSide + x;
}

struct SurfaceBrick {
  Vec3i position;
  // Bit y * 8 + x of crossed[axis][z]: the edge from sample (x, y, z) along axis crosses the surface.
  std::array<std::array<std::uint64_t, kBrick>, 3> crossed{};
  // Vertices of this brick before those of crossed[axis][z].
  std::array<std::array<std::uint16_t, kBrick>, 3> before{};
  std::uint32_t edgeVertexCount = 0;
  std::uint32_t centreCount = 0;
  std::uint32_t triangleCount = 0;
  std::uint64_t firstVertex = 0;
  std::uint64_t firstTriangle = 0;

  std::uint32_t vertex(int axis, const Vec3i& start) const {
    const std::uint64_t lower = (std::uint64_t(1) << (start.y * kBrick + start.x)) - 1;
    return std::uint32_t(firstVertex) + before[axis][start.z] +
           std::uint32_t(std::popcount(crossed[axis][start.z] & lower));
  }
};

// What a brick's stored samples hold, by bits.
enum Sides : std::uint8_t { kOutside = 1, kInside = 2, kBoth = 3 };

class Mesher {
 public:
  Mesher(const BrickGrid& grid, float isovalue)
      : grid_(grid), isovalue_(isovalue), table_(CellTable::instance()) {
    sides_.reserve(grid.poolSize());
    for (const Interval& range : grid.ranges()) {
      const bool inside = range.max > isovalue;
      const bool outside = !(range.min > isovalue);
      sides_.push_back(std::uint8_t((inside ? kInside : 0) | (outside ? kOutside : 0)));
    }
    for (int i = 0; i < 9; ++i) linear_[i] = grid.indexToWorld().linear.m[i];
    translation_ = Vec3d(grid.indexToWorld().translation);
    mirrored_ = determinant(grid.indexToWorld().linear) < 0;
  }

  Mesh run(const Progress& progress) {
    progress.begin("surface bricks");
    findBricks(progress);
    progress.count("bricks", double(bricks_.size()));
    progress.begin("triangles");
    Mesh mesh = allocate();
    parallelFor(
        bricks_.size(), 16,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) write(bricks_[i], mesh);
        },
        progress);
    progress.count("triangles", double(mesh.faceCount()));
    return mesh;
  }

 private:
  // Rows of bricks along x, from the layer before the table on.
  std::size_t rowCount() const {
    return std::size_t(grid_.brickCount().y + 1) * std::size_t(grid_.brickCount().z + 1);
  }
  std::size_t rowOf(const Vec3i& b) const {
    return std::size_t(b.z - grid_.firstBrick().z + 1) * std::size_t(grid_.brickCount().y + 1) +
           std::size_t(b.y - grid_.firstBrick().y + 1);
  }

  void findBricks(const Progress& progress) {
    std::vector<std::vector<SurfaceBrick>> rows(rowCount());
    parallelFor(
        rows.size(), 8,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t row = begin; row < end; ++row) findBricksInRow(row, rows[row]);
        },
        progress);
    rowStart_.reserve(rows.size() + 1);
    rowStart_.push_back(0);
    for (const auto& row : rows) rowStart_.push_back(rowStart_.back() + row.size());
    bricks_.reserve(rowStart_.back());
    for (auto& row : rows) {
      bricks_.insert(bricks_.end(), row.begin(), row.end());
      std::vector<SurfaceBrick>().swap(row);
    }
  }

  void findBricksInRow(std::size_t row, std::vector<SurfaceBrick>& found) const {
    Samples samples;
    SignRows signs;
    const int rowsPerLayer = grid_.brickCount().y + 1;
    Vec3i b{0, grid_.firstBrick().y - 1 + int(row) % rowsPerLayer,
            grid_.firstBrick().z - 1 + int(row) / rowsPerLayer};
    for (int x = -1; x < grid_.brickCount().x; ++x) {
      b.x = grid_.firstBrick().x + x;
      if (!mayCross(b)) continue;
      gather(b, samples);
      // Ranges do not show NaN, so a neighbour could miss the surface about it.
      require(std::none_of(samples.begin(), samples.end(), [](float v) { return std::isnan(v); }),
              "marchingCubes: the grid holds samples that are not numbers (NaN)");
      if (!computeSigns(samples, signs)) continue;
      SurfaceBrick brick;
      brick.position = b;
      countBrick(samples, signs, brick);
      if (brick.triangleCount + brick.edgeVertexCount > 0) found.push_back(brick);
    }
  }

  // A brick with its own borders knows the range of its cells; a constant one has to ask the bricks after it.
  bool mayCross(const Vec3i& b) const {
    const std::int32_t pool = grid_.poolIndex(b);
    unsigned sides = sides_[pool];
    const Interval& own = grid_.ranges()[pool];
    if (own.min < own.max) return sides == kBoth;
    for (int i = 1; i < 8; ++i) {
      sides |= sides_[grid_.poolIndex({b.x + (i & 1), b.y + (i >> 1 & 1), b.z + (i >> 2)})];
    }
    return sides == kBoth;
  }

  void gather(const Vec3i& b, Samples& samples) const {
    for (int i = 0; i < 8; ++i) {
      const Vec3i step{i & 1, i >> 1 & 1, i >> 2};
      const float* source = grid_.brick(grid_.poolIndex(b + step));
      const Vec3i begin = step * kBrick;
      const Vec3i count{step.x ? 1 : kBrick, step.y ? 1 : kBrick, step.z ? 1 : kBrick};
      for (int z = 0; z < count.z; ++z) {
        for (int y = 0; y < count.y; ++y) {
          const float* from =
              source +
              ((z + BrickGrid::kBefore) * BrickGrid::kWidth + y + BrickGrid::kBefore) * BrickGrid::kWidth +
              BrickGrid::kBefore;
          std::copy_n(from, count.x, samples.data() + sampleIndex(begin.x, begin.y + y, begin.z + z));
        }
      }
    }
  }

  // False where all samples are on one side.
  bool computeSigns(const Samples& samples, SignRows& signs) const {
    unsigned any = 0;
    unsigned all = ~0u;
    const float* row = samples.data();
    for (int z = 0; z < kSide; ++z) {
      for (int y = 0; y < kSide; ++y, row += kSide) {
        unsigned bits = 0;
        for (int x = 0; x < kSide; ++x) bits |= unsigned(row[x] > isovalue_) << x;
        signs[z][y] = std::uint16_t(bits);
        any |= bits;
        all &= bits;
      }
    }
    return any != 0 && (all & 0x1ff) != 0x1ff;
  }

  void countBrick(const Samples& samples, const SignRows& signs, SurfaceBrick& brick) const {
    for (int z = 0; z < kBrick; ++z) {
      for (int y = 0; y < kBrick; ++y) {
        const unsigned here = signs[z][y];
        const auto put = [&](int axis, unsigned bits) {
          brick.crossed[axis][z] |= std::uint64_t(bits & 0xff) << (y * kBrick);
        };
        put(0, here ^ here >> 1);
        put(1, here ^ signs[z][y + 1]);
        put(2, here ^ signs[z + 1][y]);
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (int z = 0; z < kBrick; ++z) {
        brick.before[axis][z] = std::uint16_t(brick.edgeVertexCount);
        brick.edgeVertexCount += std::uint32_t(std::popcount(brick.crossed[axis][z]));
      }
    }
    forEachCell(samples, signs, [&](const Vec3i&, const CellTable::Pattern& pattern) {
      brick.triangleCount += pattern.triangleCount;
      brick.centreCount += pattern.hasCentre;
    });
  }

  template <class Body>
  void forEachCell(const Samples& samples, const SignRows& signs, const Body& body) const {
    for (int z = 0; z < kBrick; ++z) {
      for (int y = 0; y < kBrick; ++y) {
        const unsigned r[4] = {signs[z][y], signs[z][y + 1], signs[z + 1][y], signs[z + 1][y + 1]};
        const unsigned any = r[0] | r[1] | r[2] | r[3];
        const unsigned all = r[0] & r[1] & r[2] & r[3];
        for (unsigned mixed = (any | any >> 1) & ~(all & all >> 1) & 0xff; mixed; mixed &= mixed - 1) {
          const int x = std::countr_zero(mixed);
          const unsigned cell =
              (r[0] >> x & 3) | (r[1] >> x & 3) << 2 | (r[2] >> x & 3) << 4 | (r[3] >> x & 3) << 6;
          const unsigned ambiguous = table_.ambiguousFaces(cell);
          const auto value = [&](int corner) {
            return double(samples[sampleIndex(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2))]) -
                   isovalue_;
          };
          const unsigned joined = ambiguous ? CellTable::joinedFaces(cell, ambiguous, value) : 0;
          body(Vec3i{x, y, z}, table_.pattern(cell, joined));
        }
      }
    }
  }

  Mesh allocate() {
    std::uint64_t vertexCount = 0;
    std::uint64_t triangleCount = 0;
    for (SurfaceBrick& brick : bricks_) {
      brick.firstVertex = vertexCount;
      brick.firstTriangle = triangleCount;
      vertexCount += brick.edgeVertexCount + brick.centreCount;
      triangleCount += brick.triangleCount;
    }
    require(3 * triangleCount < std::numeric_limits<std::uint32_t>::max(),
            "marchingCubes: the surface has " + std::to_string(triangleCount) +
                " triangles, more than a mesh can number; use larger voxels");
    Mesh mesh;
    detail::resizeLarge(mesh.positions, vertexCount);
    detail::resizeLarge(mesh.corners, 3 * triangleCount);
    detail::resizeLarge(mesh.faceStart, triangleCount + 1);
    return mesh;
  }

  // Null where the surface does not cross the brick.
  const SurfaceBrick* findBrick(const Vec3i& b) const {
    const Vec3i last = grid_.firstBrick() + grid_.brickCount();
    if (b.x >= last.x || b.y >= last.y || b.z >= last.z) return nullptr;
    const std::size_t row = rowOf(b);
    const auto end = bricks_.begin() + std::ptrdiff_t(rowStart_[row + 1]);
    const auto it = std::lower_bound(bricks_.begin() + std::ptrdiff_t(rowStart_[row]), end, b.x,
                                     [](const SurfaceBrick& brick, int x) { return brick.position.x < x; });
    return it != end && it->position.x == b.x ? &*it : nullptr;
  }

  Vec3d toWorld(const Vec3d& p) const {
    const auto& m = linear_;
    return Vec3d{m[0] * p.x + m[1] * p.y + m[2] * p.z, m[3] * p.x + m[4] * p.y + m[5] * p.z,
                 m[6] * p.x + m[7] * p.y + m[8] * p.z} +
           translation_;
  }

  // Index-space position of the zero on the edge from sample `start` of the brick at `origin` along `axis`.
  Vec3d edgePoint(const Samples& samples, const Vec3i& origin, const Vec3i& start, int axis) const {
    const int at = sampleIndex(start.x, start.y, start.z);
    const double a = samples[at];
    const double b = samples[at + kStride[axis]];
    double t = (a - isovalue_) / (a - b);
    if (std::isnan(t)) t = 0.5;
    Vec3d p(origin + start);
    p[axis] += std::clamp(t, kMargin, 1 - kMargin);
    return p;
  }

  void write(const SurfaceBrick& brick, Mesh& mesh) const {
    Samples samples;
    SignRows signs;
    gather(brick.position, samples);
    computeSigns(samples, signs);
    const Vec3i origin = brick.position * kBrick;

    Vec3d* position = mesh.positions.data() + brick.firstVertex;
    for (int axis = 0; axis < 3; ++axis) {
      for (int z = 0; z < kBrick; ++z) {
        for (std::uint64_t bits = brick.crossed[axis][z]; bits; bits &= bits - 1) {
          const int bit = std::countr_zero(bits);
          *position++ = toWorld(edgePoint(samples, origin, {bit % kBrick, bit / kBrick, z}, axis));
        }
      }
    }

    std::array<const SurfaceBrick*, 8> owners;
    for (int i = 0; i < 8; ++i) {
      owners[i] = i == 0 ? &brick : findBrick(brick.position + Vec3i{i & 1, i >> 1 & 1, i >> 2});
    }
    std::uint32_t* corner = mesh.corners.data() + 3 * brick.firstTriangle;
    forEachCell(samples, signs, [&](const Vec3i& cell, const CellTable::Pattern& pattern) {
      std::array<std::uint32_t, CellTable::kCentre + 1> vertices;
      const auto edgeStart = [&](int edge) {
        const int c = CellTable::edgeStart(edge);
        return cell + Vec3i{c & 1, c >> 1 & 1, c >> 2};
      };
      const auto corners = table_.corners(pattern);
      unsigned known = 0;
      for (const int edge : corners) {
        if (known >> edge & 1 || edge == CellTable::kCentre) continue;
        known |= 1u << edge;
        const Vec3i start = edgeStart(edge);
        const SurfaceBrick* owner = owners[(start.x >> 3) + 2 * (start.y >> 3) + 4 * (start.z >> 3)];
        require(owner != nullptr, "marchingCubes: the grid holds samples outside the ranges of its bricks");
        vertices[edge] = owner->vertex(CellTable::edgeAxis(edge), {start.x & 7, start.y & 7, start.z & 7});
      }
      if (pattern.hasCentre) {
        Vec3d sum;
        int count = 0;
        for (std::size_t i = 0; i < corners.size(); i += 3) {
          if (corners[i + 2] != CellTable::kCentre) continue;
          sum += edgePoint(samples, origin, edgeStart(corners[i]), CellTable::edgeAxis(corners[i]));
          ++count;
        }
        vertices[CellTable::kCentre] = std::uint32_t(position - mesh.positions.data());
        *position++ = toWorld(sum / double(count));
      }
      for (std::size_t i = 0; i < corners.size(); i += 3) {
        *corner++ = vertices[corners[i]];
        *corner++ = vertices[corners[i + (mirrored_ ? 2 : 1)]];
        *corner++ = vertices[corners[i + (mirrored_ ? 1 : 2)]];
      }
    });
    for (std::uint64_t t = brick.firstTriangle; t < brick.firstTriangle + brick.triangleCount; ++t) {
      mesh.faceStart[t + 1] = std::uint32_t(3 * (t + 1));
    }
  }

  const BrickGrid& grid_;
  const float isovalue_;
  const CellTable& table_;
  std::vector<std::uint8_t> sides_;
  std::vector<SurfaceBrick> bricks_;
  // First of bricks_ in each row.
  std::vector<std::size_t> rowStart_;
  std::array<double, 9> linear_{};
  Vec3d translation_;
  bool mirrored_ = false;
};

}  // namespace

Mesh marchingCubes(const BrickGrid& grid, float isovalue, const Progress& progress) {
  require(std::isfinite(isovalue), "marchingCubes: isovalue must be finite, got " + numberText(isovalue));
  return Mesher(grid, isovalue).run(progress);
}

}  // namespace nephele
