// The way of a near light through a volume, in one sweep along its rays.
//
// Columns of nodes are light rays: node (i, j, k) of a face stands at depth k / perDepth on the ray through
// the tangents (i, j) / perTangent. Depth, not length, is the third coordinate, so that a look-up takes one
// division: along a camera ray numerators and denominator are linear. The integral down a column is a running
// sum of trapezoids over half slices. Near the light the column grows in proportion to depth, which linear
// interpolation gives exactly, so that a light inside of the volume needs no special care.
//
// Stored are the bricks of the lattice that a brick with density reaches into, its box projected; between
// them nothing is added. As in LightVolume, nodes hold c less the mean error of linear interpolation.
//
// Limits: resolved at the density's own spacing at three quarters of the largest depth; where that would take
// more than six bricks for one of the density's, coarser across.
#include "nephele/render/light/projected_light_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/detail/light_slices.h"
#include "nephele/render/light/light_volume.h"
#include "nephele/render/scene/sub_samples.h"
#include "nephele/render/volume/trilinear.h"

namespace nephele {

namespace {

constexpr int kBrick = LightVolume::kBrick;
constexpr int kWidth = LightVolume::kWidth;
constexpr int kRays = kWidth + 2;  // across a brick, one more on every side for differences
constexpr int kArea = kRays * kRays;
constexpr float kWidestDegrees = 50;
constexpr float kFarthestSides = 2000;

double brickBudget(const RenderVolume& volume) {
  return 6.0 * (double(volume.occupiedBricks().size()) + 512);
}

// A rotation whose third row is `axis`.
Mat3f frameAlong(const Vec3f& axis) {
  const Vec3f w = normalize(axis);
  const Vec3f u = std::fabs(w.x) > 0.7f ? normalize(Vec3f{-w.y, w.x, 0}) : normalize(Vec3f{0, -w.z, w.y});
  const Vec3f v = cross(w, u);
  return {{u.x, u.y, u.z, v.x, v.y, v.z, w.x, w.y, w.z}};
}

std::array<Vec3f, 8> corners(const Box& box, const Affine& map) {
  std::array<Vec3f, 8> result;
  for (int i = 0; i != 8; ++i)
    result[std::size_t(i)] =
        map({i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y, i & 4 ? box.max.z : box.min.z});
  return result;
}

Affine composed(const Affine& outer, const Affine& inner) {
  return {outer.linear * inner.linear, outer(inner.translation)};
}

}  // namespace

// One face, as its columns are summed.
struct ProjectedLightVolume::Sweep {
  using Nodes = std::array<float, kArea>;

  const BrickGrid& grid;
  Face& face;
  const Affine& frameToIndex;
  int u, v;
  // From the light, per slice, of the rays of a column.
  std::array<Vec3d, kArea> ways{};
  Nodes steps{};

  Sweep(const BrickGrid& density, Face& toFill, const Affine& map)
      : grid(density), face(toFill), frameToIndex(map), u((toFill.axis + 1) % 3), v((toFill.axis + 2) % 3) {}

  float density(const Vec3d& p) const {
    const Vec3d floor{std::floor(p.x), std::floor(p.y), std::floor(p.z)};
    const Vec3i cell{int(floor.x), int(floor.y), int(floor.z)};
    const std::int32_t pool = grid.poolIndex(brickOf(cell));
    if (!(grid.ranges()[std::size_t(pool)].max > 0)) return 0.0f;
    const Vec3f f(p - floor);
    constexpr int row = BrickGrid::kWidth, plane = row * row;
    const float* at =
        grid.brick(pool) + sampleOffset(insideBrick(cell.x), insideBrick(cell.y), insideBrick(cell.z));
    const auto edge = [&](int offset) { return at[offset] + f.x * (at[offset + 1] - at[offset]); };
    const float near0 = edge(0), near1 = edge(row), far0 = edge(plane), far1 = edge(plane + row);
    const float near = near0 + f.y * (near1 - near0), far = far0 + f.y * (far1 - far0);
    return std::max(near + f.z * (far - near), 0.0f);
  }

  void densities(double slice, Nodes& out) const {
    const Vec3d light(frameToIndex.translation);
    for (std::size_t m = 0; m != kArea; ++m) out[m] = density(light + ways[m] * slice);
  }

  void aim(int bu, int bv) {
    for (int j = 0; j != kRays; ++j)
      for (int i = 0; i != kRays; ++i) {
        Vec3f way;
        way[u] = float(bu * kBrick + i - 1) / face.perTangent;
        way[v] = float(bv * kBrick + j - 1) / face.perTangent;
        way[face.axis] = face.side;
        const auto m = std::size_t(j * kRays + i);
        steps[m] = length(way) / face.perDepth;
        ways[m] = Vec3d(frameToIndex.linear * way) * (1.0 / double(face.perDepth));
      }
  }

  // Sums the density down one column of bricks.
  void fill(std::size_t column) {
    const Vec3i first = face.firstBrick, count = face.brickCount;
    aim(first.x + int(column % std::size_t(count.x)), first.y + int(column / std::size_t(count.x)));
    const auto poolAt = [&](int n) {
      return face.table[std::size_t(n) * std::size_t(count.x) * std::size_t(count.y) + column];
    };
    Nodes sum{}, before{}, after{}, here{}, half{}, next{};
    detail::forEachFilledRun(count.z, poolAt, [&](int n, int end) {
      const int slices = (end - n) * kBrick, k0 = (first.z + n) * kBrick;
      before.fill(0.0f);
      densities(k0, here);
      for (int slice = 0; slice <= slices; ++slice) {
        after.fill(0.0f);
        if (slice < slices) {
          densities(k0 + slice + 0.5, half);
          densities(k0 + slice + 1, next);
          for (std::size_t m = 0; m != kArea; ++m)
            after[m] = 0.25f * steps[m] * (here[m] + 2 * half[m] + next[m]);
          std::swap(here, next);
        }
        const int brick = n + slice / kBrick, inside = slice % kBrick;
        if (slice < slices) store(poolAt(brick), inside, sum, before, after);
        if (slice > 0 && inside == 0) store(poolAt(brick - 1), kBrick, sum, before, after);
        for (std::size_t m = 0; m != kArea; ++m) sum[m] += after[m];
        std::swap(before, after);
      }
    });
  }

  void store(std::int32_t pool, int inside, const Nodes& sum, const Nodes& before, const Nodes& after) {
    float* out = face.values.data() + (std::size_t(pool) * kWidth + std::size_t(inside)) * kWidth * kWidth;
    for (int j = 0; j != kWidth; ++j)
      for (int i = 0; i != kWidth; ++i) {
        const auto at = std::size_t((j + 1) * kRays + i + 1);
        const float across = sum[at - 1] + sum[at + 1] + sum[at - kRays] + sum[at + kRays] - 4 * sum[at];
        out[j * kWidth + i] = sum[at] - (across + after[at] - before[at]) / 12;
      }
  }
};

ProjectedLightVolume::ProjectedLightVolume(const RenderVolume& volume, const LocalLight& light,
                                           const Progress& progress) {
  require(isFinite(light.position), light.name + ": expected a position that is finite");
  worldToFrame_ = {Mat3f::identity(), -light.position};
  faces_.resize(1);
  faces_[0].brickCount = {1, 1, 1};
  faces_[0].table.assign(1, 0);
  faces_[0].values.assign(LightVolume::kVolume, 0.0f);
  if (volume.isEmpty()) return;
  place(volume, light);

  for (Face& face : faces_) {
    const Sweep sweep(volume.density(), face, frameToIndex_);
    parallelFor(
        std::size_t(face.brickCount.x) * std::size_t(face.brickCount.y), 1,
        [&](std::size_t begin, std::size_t end) {
          Sweep own = sweep;
          for (std::size_t column = begin; column != end; ++column) own.fill(column);
        },
        progress);
  }
}

// Chooses the frame, the faces and their spacing, and numbers their bricks.
void ProjectedLightVolume::place(const RenderVolume& volume, const LocalLight& light) {
  const BrickGrid& grid = volume.density();
  const std::array<Vec3f, 8> box = corners(volume.indexBounds(), grid.indexToWorld());
  Vec3f middle;
  for (const Vec3f& corner : box) middle += corner * 0.125f;
  float widest = 0, side = length(box[7] - box[0]);
  const Vec3f towards = normalize(middle - light.position);
  for (const Vec3f& corner : box) {
    const float cosine = dot(towards, normalize(corner - light.position));
    widest = std::max(widest, degrees(std::acos(std::clamp(cosine, -1.0f, 1.0f))));
  }
  require(
      length(middle - light.position) <= kFarthestSides * side,
      fmt::format("{}: is {:g} away from a volume {:g} across; use a sun for a light beyond {:g} times that",
                  light.name, length(middle - light.position), side, kFarthestSides));

  float tangent = 1;
  const bool seesAll = towards != Vec3f{} && widest <= kWidestDegrees;
  if (light.cone && light.cone->angleDegrees <= kWidestDegrees &&
      (!seesAll || light.cone->angleDegrees < widest)) {
    worldToFrame_.linear = frameAlong(light.cone->direction);
    tangent = std::tan(radians(light.cone->angleDegrees));
  } else if (seesAll) {
    worldToFrame_.linear = frameAlong(towards);
    tangent = std::tan(radians(widest));
  } else {
    faces_.assign(6, faces_[0]);
    for (int i = 0; i != 6; ++i) {
      faces_[std::size_t(i)].axis = i / 2;
      faces_[std::size_t(i)].side = i % 2 ? -1.0f : 1.0f;
    }
  }
  worldToFrame_.translation = -(worldToFrame_.linear * light.position);
  const Affine frameToWorld{transpose(worldToFrame_.linear), light.position};
  frameToIndex_ = composed(grid.worldToIndex(), frameToWorld);

  const double budget = brickBudget(volume);
  std::array<std::size_t, 6> bricks{};
  for (float coarseness = 1;; coarseness *= 1.25f) {
    double stored = 0, entries = 0;
    for (Face& face : faces_) {
      float deepest = 0;
      for (const Vec3f& corner : box)
        deepest = std::max(deepest, face.side * worldToFrame_(corner)[face.axis]);
      // Faces that look away from the volume keep their brick of nothing.
      if (!(deepest > 0)) continue;
      face.perDepth = 1 / grid.voxelSize();
      face.perTangent = std::max(0.75f * deepest / (grid.voxelSize() * coarseness), 4.0f);
      bricks[std::size_t(&face - faces_.data())] = findBricks(volume, face, tangent);
      stored += double(bricks[std::size_t(&face - faces_.data())]);
      entries += double(face.table.size());
    }
    if ((stored <= budget && entries <= 64 * budget) || coarseness > 1000) break;
  }
  for (std::size_t i = 0; i != faces_.size(); ++i)
    detail::resizeLarge(faces_[i].values, (bricks[i] + 1) * LightVolume::kVolume);
}

// Returns how many there are beside the brick of nothing.
std::size_t ProjectedLightVolume::findBricks(const RenderVolume& volume, Face& face, float tangent) const {
  const Affine indexToFrame = composed(worldToFrame_, volume.density().indexToWorld());
  const int u = (face.axis + 1) % 3, v = (face.axis + 2) % 3;
  // Nodes beside the last ones are needed for differences and rounding.
  constexpr float slack = 1.01f;
  const float nearest = 1 / face.perDepth, limit = tangent + 2 * slack / face.perTangent;
  struct Reach {
    Vec3i first, last;
  };
  std::vector<Reach> reached;
  Vec3i low{1 << 30, 1 << 30, 1 << 30}, high = -low;
  for (const Vec3i& brick : volume.occupiedBricks()) {
    const Vec3f corner(brick * BrickGrid::kBrick);
    Vec3f least{INFINITY, INFINITY, INFINITY}, most = -least;  // u, v, w
    float tangents[2][2] = {{INFINITY, -INFINITY}, {INFINITY, -INFINITY}};
    for (const Vec3f& p : corners({corner, corner + Vec3f{1, 1, 1} * BrickGrid::kBrick}, indexToFrame)) {
      const Vec3f q{p[u], p[v], face.side * p[face.axis]};
      least = min(least, q);
      most = max(most, q);
      for (int axis = 0; axis != 2; ++axis) {
        tangents[axis][0] = std::min(tangents[axis][0], q[axis] / q.z);
        tangents[axis][1] = std::max(tangents[axis][1], q[axis] / q.z);
      }
    }
    if (!(most.z > 0)) continue;
    Reach reach;
    bool misses = false;
    for (int axis = 0; axis != 2; ++axis) {
      misses = misses || least[axis] > limit * most.z || most[axis] < -limit * most.z;
      const bool isClose = !(least.z > nearest);
      const float a = isClose ? -limit : std::max(tangents[axis][0], -limit),
                  b = isClose ? limit : std::min(tangents[axis][1], limit);
      misses = misses || a > b;
      if (misses) break;
      reach.first[axis] = int(std::floor((a * face.perTangent - slack) / kBrick));
      reach.last[axis] = int(std::floor((b * face.perTangent + slack) / kBrick));
    }
    if (misses) continue;
    reach.first.z = int(std::floor(std::max(least.z * face.perDepth - 0.01f, 0.0f) / kBrick));
    reach.last.z = int(std::floor((most.z * face.perDepth + 0.01f) / kBrick));
    low = min(low, reach.first);
    high = max(high, reach.last);
    reached.push_back(reach);
  }
  face.firstBrick = reached.empty() ? Vec3i{} : low;
  face.brickCount = reached.empty() ? Vec3i{1, 1, 1} : high - low + Vec3i{1, 1, 1};
  const Vec3i n = face.brickCount;
  face.table.assign(std::size_t(n.x) * std::size_t(n.y) * std::size_t(n.z), 0);
  for (const Reach& reach : reached)
    for (int k = reach.first.z; k <= reach.last.z; ++k)
      for (int j = reach.first.y; j <= reach.last.y; ++j)
        for (int i = reach.first.x; i <= reach.last.x; ++i)
          face.table[(std::size_t(k - low.z) * std::size_t(n.y) + std::size_t(j - low.y)) * std::size_t(n.x) +
                     std::size_t(i - low.x)] = 1;
  std::int32_t pool = 0;
  for (std::int32_t& brick : face.table)
    if (brick) brick = ++pool;
  return std::size_t(pool);
}

void ProjectedLightVolume::replace(const std::function<float(const Vec3f&)>& column) {
  const Affine frameToWorld = inverse(worldToFrame_);
  for (Face& face : faces_)
    parallelFor(face.table.size(), 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t entry = begin; entry != end; ++entry) {
        if (!face.table[entry]) continue;
        const auto nx = std::size_t(face.brickCount.x), ny = std::size_t(face.brickCount.y);
        const Vec3i node =
            (face.firstBrick + Vec3i{int(entry % nx), int(entry / nx % ny), int(entry / (nx * ny))}) * kBrick;
        detail::replaceBrick(
            [&](const Vec3i& at) {
              // The first slice before the light is the light.
              const float depth = std::max(float(node.z + at.z) / face.perDepth, 0.0f);
              Vec3f q;
              q[(face.axis + 1) % 3] = float(node.x + at.x) / face.perTangent * depth;
              q[(face.axis + 2) % 3] = float(node.y + at.y) / face.perTangent * depth;
              q[face.axis] = face.side * depth;
              return column(frameToWorld(q));
            },
            face.values.data() + std::size_t(face.table[entry]) * LightVolume::kVolume);
      }
    });
}

void ProjectedLightVolume::addShade(const std::function<double(const Ray&)>& distanceToShade,
                                    float perDepth) {
  const Affine frameToWorld = inverse(worldToFrame_);
  const Vec3d light(frameToWorld.translation);
  for (Face& face : faces_) {
    const std::size_t nx = std::size_t(face.brickCount.x), across = nx * std::size_t(face.brickCount.y);
    parallelFor(across, 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t column = begin; column != end; ++column) {
        bool isThere = false;
        for (std::size_t n = 0; n != std::size_t(face.brickCount.z); ++n)
          isThere = isThere || face.table[n * across + column];
        if (!isThere) continue;
        const Vec3i node = (face.firstBrick + Vec3i{int(column % nx), int(column / nx), 0}) * kBrick;
        detail::ColumnShade shade;
        for (std::size_t m = 0; m != shade.begins.size(); ++m)
          for (std::size_t p = 0; p != 4; ++p) {
            Vec3f q;
            q[(face.axis + 1) % 3] =
                (float(node.x + int(m) % kWidth) + kQuarterCorners[p].x) / face.perTangent;
            q[(face.axis + 2) % 3] =
                (float(node.y + int(m) / kWidth) + kQuarterCorners[p].y) / face.perTangent;
            q[face.axis] = face.side;
            const Vec3d way(frameToWorld.linear * q);
            shade.begins[m][p] =
                float(distanceToShade({light, normalize(way)}) / length(way)) * face.perDepth;
          }
        for (std::size_t n = 0; n != std::size_t(face.brickCount.z); ++n)
          if (const std::int32_t pool = face.table[n * across + column])
            shade.addTo(face.values.data() + std::size_t(pool) * LightVolume::kVolume,
                        node.z + int(n) * kBrick, perDepth);
      }
    });
  }
}

float ProjectedLightVolume::columnDensity(const Vec3f& world) const {
  const Vec3f q = worldToFrame_(world);
  const Face* face = nullptr;
  float depth = 0;
  for (const Face& one : faces_)
    if (const float w = one.side * q[one.axis]; w > depth) depth = w, face = &one;
  if (!face) return 0.0f;
  const Vec3f p{q[(face->axis + 1) % 3] / depth * face->perTangent,
                q[(face->axis + 2) % 3] / depth * face->perTangent, depth * face->perDepth};
  Vec3i cell, brick;
  for (int axis = 0; axis != 3; ++axis) {
    if (!(std::fabs(p[axis]) < 1e8f)) return 0.0f;
    cell[axis] = int(std::floor(p[axis]));
    brick[axis] = brickOf(cell[axis]) - face->firstBrick[axis];
    if (brick[axis] < 0 || brick[axis] >= face->brickCount[axis]) return 0.0f;
  }
  return BrickSampler<kWidth, 0>{face->values.data(), face->table.data(),
                                 face->brickCount}(p - Vec3f(face->firstBrick * LightVolume::kBrick));
}

std::size_t ProjectedLightVolume::memoryBytes() const {
  std::size_t bytes = 0;
  for (const Face& face : faces_)
    bytes += face.values.size() * sizeof(float) + face.table.size() * sizeof(std::int32_t);
  return bytes;
}

double ProjectedLightVolume::estimateBytes(const RenderVolume& volume) {
  return (brickBudget(volume) + 6) * (LightVolume::kVolume * sizeof(float) + 64.0 * sizeof(std::int32_t));
}

}  // namespace nephele
