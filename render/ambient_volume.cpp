// The sky's light, from a few directions through a coarse density.
//
// The density is averaged onto a lattice of at most 128 nodes a side. For every direction, spread over the
// sphere by the golden angle, the column density is carried from slice to slice along the axis that the
// direction is closest to, read between the nodes of the slice before. That reading blurs sideways as it
// goes, which is what light from a part of the sky does, so that few directions suffice. Directions with the
// same axis and side share a pass; the six passes run in parallel and are added in a fixed order.
//
// The weights of the octaves, 0.45^n albedo^(2^n - 1), keep creases dark: a half space under a bright half
// sky, seen head on, comes out at 0.36 of the sky for albedo 0.98, where Chandrasekhar's 1 - H(1) sqrt(1 -
// albedo) is 0.67.
//
// Limits: occlusion finer than the lattice is left to the sun; the sky's own light is taken to scatter
// equally everywhere.
#include "render/ambient_volume.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "modeling/error.h"
#include "modeling/parallel.h"

namespace nephele {

namespace {

constexpr float kContribution = 0.45f;
constexpr int kMostOctaves = 16;
// Optical depth between two nodes that interpolation still hides.
constexpr float kResolved = 0.75f;

// exp(-x) for 0 <= x <= 80 in a form that compilers vectorise: 2^whole times a polynomial in the rest; 2e-6
// relative.
inline float expOfMinus(float x) {
  const float y = x * -1.44269504f;
  const int whole = int(y - 0.5f);
  const float r = (y - float(whole)) * 0.69314718f;
  const float p =
      1 + r * (1 + r * (0.5f + r * (1.0f / 6 + r * (1.0f / 24 + r * (1.0f / 120 + r * (1.0f / 720))))));
  return p * std::bit_cast<float>(std::uint32_t(whole + 127) << 23);
}

// A lattice of densities, axes as they come or permuted.
struct Lattice {
  Vec3i size;
  std::vector<float> values;

  explicit Lattice(const Vec3i& n) : size(n), values(std::size_t(n.x) * n.y * n.z) {}
  std::size_t index(int x, int y, int z) const {
    return (std::size_t(z) * size.y + std::size_t(y)) * size.x + std::size_t(x);
  }
};

// Mean density of cells of `factor`^3 voxels (1, 2, 4 or 8), the first of which starts at voxel 8 *
// firstBrick.
Lattice averaged(const RenderVolume& volume, const Vec3i& firstBrick, const Vec3i& bricks, int factor) {
  const BrickGrid& grid = volume.density();
  const int perBrick = BrickGrid::kBrick / factor;
  Lattice lattice(bricks * perBrick);
  const std::vector<Vec3i>& occupied = volume.occupiedBricks();
  parallelFor(occupied.size(), 128, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i) {
      const Vec3i origin = (occupied[i] - firstBrick) * perBrick;
      const float* values = grid.brick(grid.poolIndex(occupied[i]));
      for (int z = 0; z != BrickGrid::kBrick; ++z)
        for (int y = 0; y != BrickGrid::kBrick; ++y) {
          const float* row = values + ((z + 1) * BrickGrid::kWidth + y + 1) * BrickGrid::kWidth + 1;
          float* out =
              lattice.values.data() + lattice.index(origin.x, origin.y + y / factor, origin.z + z / factor);
          for (int x = 0; x != BrickGrid::kBrick; ++x) out[x / factor] += std::max(row[x], 0.0f);
        }
    }
  });
  const float share = 1.0f / float(factor * factor * factor);
  for (float& value : lattice.values) value *= share;
  return lattice;
}

Lattice halved(const Lattice& fine) {
  Lattice coarse({(fine.size.x + 1) / 2, (fine.size.y + 1) / 2, (fine.size.z + 1) / 2});
  for (int z = 0; z != fine.size.z; ++z)
    for (int y = 0; y != fine.size.y; ++y)
      for (int x = 0; x != fine.size.x; ++x)
        coarse.values[coarse.index(x / 2, y / 2, z / 2)] += 0.125f * fine.values[fine.index(x, y, z)];
  return coarse;
}

// The lattice with its axes in another order: axis a of the result is axis order[a] of `from`.
Lattice permuted(const Lattice& from, const Vec3i& order) {
  Lattice result({from.size[order.x], from.size[order.y], from.size[order.z]});
  Vec3i at;
  std::size_t i = 0;
  for (at[order.z] = 0; at[order.z] != result.size.z; ++at[order.z])
    for (at[order.y] = 0; at[order.y] != result.size.y; ++at[order.y])
      for (at[order.x] = 0; at[order.x] != result.size.x; ++at[order.x])
        result.values[i++] = from.values[from.index(at.x, at.y, at.z)];
  return result;
}

// Mean density that light meets where there is any.
float typicalDensity(const Lattice& lattice) {
  double sum = 0, squares = 0;
  for (const float value : lattice.values) {
    sum += value;
    squares += double(value) * value;
  }
  return sum > 0 ? float(squares / sum) : 0.0f;
}

// Averages neighbours with weights 1, 2, 1 along every axis.
void smooth(const Vec3i& size, std::vector<float>& values) {
  const std::size_t stride[3] = {1, std::size_t(size.x), std::size_t(size.x) * size.y};
  for (int axis = 0; axis != 3; ++axis) {
    const int n = size[axis], a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
    parallelFor(std::size_t(size[b]), 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j != end; ++j)
        for (int i = 0; i != size[a]; ++i) {
          float* line = values.data() + j * stride[b] + std::size_t(i) * stride[a];
          float before = line[0];
          for (int k = 0; k != n; ++k) {
            const float here = line[std::size_t(k) * stride[axis]];
            const float after = line[std::size_t(std::min(k + 1, n - 1)) * stride[axis]];
            line[std::size_t(k) * stride[axis]] = 0.25f * (before + after) + 0.5f * here;
            before = here;
          }
        }
    });
  }
}

// One slice with a rim of `kRim` zeros, so that reading beside the lattice finds no density.
constexpr int kRim = 2;

struct Slice {
  int width, height;
  std::vector<float> values;

  Slice(int w, int h) : width(w + 2 * kRim), height(h + 2 * kRim), values(std::size_t(width) * height) {}
  float* row(int y) { return values.data() + std::size_t(y + kRim) * width + kRim; }
};

/// Adds what light from one direction leaves at every node. `towards` is the way to the light in nodes of
/// `density`.
void sweep(const Lattice& density, const Vec3f& towards, float share, const std::vector<float>& weights,
           float extinction, std::vector<float>& sum) {
  const Vec3i n = density.size;
  const float du = towards.x / std::fabs(towards.z), dv = towards.y / std::fabs(towards.z);
  const float step = extinction / std::fabs(towards.z);  // optical depth of a slice of density 1
  const int iu = int(std::floor(du)), iv = int(std::floor(dv));
  const float fu = du - float(iu), fv = dv - float(iv);
  const float w00 = (1 - fu) * (1 - fv), w10 = fu * (1 - fv), w01 = (1 - fu) * fv, w11 = fu * fv;
  const int octaves = int(weights.size());
  const float least = std::ldexp(1.0f, -(octaves - 1));

  Slice ahead(n.x, n.y), here(n.x, n.y);
  std::vector<float> light(std::size_t(n.x)), power(std::size_t(n.x));
  for (int slice = 0; slice != n.z; ++slice) {
    const int z = towards.z > 0 ? n.z - 1 - slice : slice;
    for (int y = 0; y != n.y; ++y) {
      const float *a = ahead.row(y + iv) + iu, *b = ahead.row(y + iv + 1) + iu;
      const float* rho = density.values.data() + density.index(0, y, z);
      float *out = here.row(y), *total = sum.data() + density.index(0, y, z);
      for (int x = 0; x != n.x; ++x) {
        const float half = 0.5f * step * rho[x];
        const float depth = w00 * a[x] + w10 * a[x + 1] + w01 * b[x] + w11 * b[x + 1] + half;
        out[x] = depth + half;
        power[std::size_t(x)] = expOfMinus(std::min(depth, 80.0f) * least);
      }
      std::fill(light.begin(), light.end(), 0.0f);
      for (int octave = octaves - 1; octave >= 0; --octave) {
        const float weight = share * weights[std::size_t(octave)];
        for (std::size_t x = 0; x != light.size(); ++x) {
          light[x] += weight * power[x];
          power[x] *= power[x];
        }
      }
      for (int x = 0; x != n.x; ++x) total[x] += light[std::size_t(x)];
    }
    std::swap(ahead, here);
  }
}

}  // namespace

AmbientVolume::AmbientVolume(const RenderVolume& volume, const Medium& medium, const Octaves& octaves,
                             const Progress& progress, int directions, int longestSide) {
  require(directions >= 6 && longestSide >= 8, "ambient: needs at least 6 directions and 8 nodes");
  require(octaves.count >= 1 && octaves.count <= kMostOctaves, "octaves: expected 1 to 16");
  size_ = {1, 1, 1};
  values_ = {1.0f};
  if (volume.isEmpty()) return;

  const BrickGrid& grid = volume.density();
  // One empty brick around, so that nodes beside the volume's own see the open sky.
  const Box box = volume.indexBounds();
  const Vec3i first = Vec3i(box.min * (1.0f / BrickGrid::kBrick)) - Vec3i{1, 1, 1};
  const Vec3i bricks = Vec3i(box.size() * (1.0f / BrickGrid::kBrick)) + Vec3i{2, 2, 2};
  const int longest = std::max({bricks.x, bricks.y, bricks.z}) * BrickGrid::kBrick;
  int factor = 1;
  while (factor < BrickGrid::kBrick && longest / factor > longestSide) factor *= 2;
  Lattice density = averaged(volume, first, bricks, factor);
  for (; longest / factor > longestSide; factor *= 2) density = halved(density);
  size_ = density.size;

  // Node i stands for the voxels factor i .. factor i + factor - 1.
  const float scale = 1.0f / float(factor);
  const Vec3f middle = Vec3f(first * BrickGrid::kBrick) + Vec3f{1, 1, 1} * (0.5f * float(factor - 1));
  worldToLattice_ = {Mat3f::scaling(scale) * grid.worldToIndex.linear,
                     (grid.worldToIndex.translation - middle) * scale};

  const float albedo = (medium.albedo.x + medium.albedo.y + medium.albedo.z) / 3;
  // Octaves for which a node would be nearly opaque would show the lattice; the first that it resolves takes
  // their place.
  const float cellDepth = medium.extinction * grid.voxelSize * float(factor) * typicalDensity(density);
  float extinction = medium.extinction, unresolved = 0;
  std::vector<float> weights;
  for (int n = 0; n < octaves.count || weights.empty(); ++n) {
    if (n < octaves.count)
      unresolved += std::pow(kContribution, float(n)) * std::pow(albedo, std::ldexp(1.0f, n) - 1);
    if (cellDepth > kResolved * std::ldexp(1.0f, n)) continue;
    if (weights.empty()) extinction = std::ldexp(medium.extinction, -n);
    weights.push_back(unresolved);
    unresolved = 0;
  }

  std::vector<Vec3f> passes[6];
  for (int i = 0; i != directions; ++i) {
    const float y = 1 - (2 * float(i) + 1) / float(directions), angle = 2.39996323f * float(i);
    const float r = std::sqrt(1 - y * y);
    const Vec3f towards = worldToLattice_.linear * Vec3f{r * std::cos(angle), y, r * std::sin(angle)};
    int axis = 0;
    for (int a = 1; a != 3; ++a)
      if (std::fabs(towards[a]) > std::fabs(towards[axis])) axis = a;
    passes[axis * 2 + (towards[axis] > 0)].push_back(towards);
  }
  std::vector<float> sums[6];
  parallelFor(
      6, 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t pass = begin; pass != end; ++pass) {
          const int w = int(pass) / 2, u = w == 0 ? 1 : 0, v = w == 2 ? 1 : 2;
          const Lattice turned = permuted(density, {u, v, w});
          Lattice sum(turned.size);
          for (const Vec3f& towards : passes[pass])
            sweep(turned, {towards[u], towards[v], towards[w]}, 1.0f / float(directions), weights, extinction,
                  sum.values);
          // Back to the order of the lattice: the two orders used here are (1, 2, 0), undone by (2, 0, 1),
          // and swaps.
          const Vec3i back = w == 0 ? Vec3i{2, 0, 1} : w == 1 ? Vec3i{0, 2, 1} : Vec3i{0, 1, 2};
          sums[pass] = permuted(sum, back).values;
        }
      },
      progress);
  values_.assign(density.values.size(), 0.0f);
  for (const std::vector<float>& sum : sums)
    for (std::size_t i = 0; i != values_.size(); ++i) values_[i] += sum[i];
  smooth(size_, values_);
  for (float& value : values_) value = std::min(value, 1.0f);
}

float AmbientVolume::visibility(const Vec3f& world) const {
  const Vec3f p = worldToLattice_(world);
  float sum = 0;
  Vec3i cell;
  Vec3f f;
  for (int axis = 0; axis != 3; ++axis) {
    const float x = std::clamp(p[axis], 0.0f, float(size_[axis] - 1));
    cell[axis] = std::min(int(x), std::max(size_[axis] - 2, 0));
    f[axis] = x - float(cell[axis]);
  }
  for (int corner = 0; corner != 8; ++corner) {
    const Vec3i d{corner & 1, corner >> 1 & 1, corner >> 2};
    const Vec3i at = min(cell + d, size_ - Vec3i{1, 1, 1});
    sum += (d.x ? f.x : 1 - f.x) * (d.y ? f.y : 1 - f.y) * (d.z ? f.z : 1 - f.z) *
           values_[(std::size_t(at.z) * size_.y + std::size_t(at.y)) * size_.x + std::size_t(at.x)];
  }
  return sum;
}

double AmbientVolume::estimateBytes(const RenderVolume& volume, int longestSide) {
  if (volume.isEmpty()) return 0;
  const Vec3f size = volume.indexBounds().size() + Vec3f{16, 16, 16};
  const double scale = std::min(1.0, double(longestSide) / std::max({size.x, size.y, size.z}));
  // The density twice and a sum for each of six passes.
  return 8.0 * sizeof(float) * size.x * size.y * size.z * scale * scale * scale;
}

}  // namespace nephele
