// Multiple scattering by discrete ordinates.
//
// Sweeps: for each of a few directions light is carried slice by slice through the lattice, read between the
// nodes of the slice before. A cell of optical depth t and own light S per optical depth lets through I
// exp(-t) + S (1 - exp(-t)), and holds S + (I - S) (1 - exp(-t)) / t on average. Directions with the same
// axis and side share a pass; the six passes run in parallel and are added in a fixed order.
//
// Solver: a sweep maps J to K(albedo (J + beam)), and J is its fixed point, reached by Anderson's
// acceleration (1965) with a memory of a few sweeps: where a plain iteration needs a sweep per scattering, a
// hundred and more in a cloud, this takes some eight. It begins on a lattice of a few nodes and goes on where
// the coarser one ended, as the slow part of the error is smooth.
//
// Source: discrete ordinates and short characteristics are textbook transport (Lewis and Miller,
// "Computational Methods of Neutron Transport", 1984); so is the isotropic equivalent, the transport
// correction.
//
// Limits: light spreads by half a cell per slice, so where a cell is nearly opaque too much of it reaches the
// dark side (a fifth, in a core lit from behind only) and 7 % are missing from the lit one, which the marcher
// makes up for. Cells that would hide the light altogether are thinned.
#include "nephele/render/light/scattered_light.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr int kCoarsest = 24;
constexpr int kCoarseSweeps = 60;
constexpr int kMemory = 4;
// Typical optical depth of a cell, beyond which the lattice would show.
constexpr float kDeepestCell = 4.0f;

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

struct Lattice {
  Vec3i size;
  /// Voxels along a cell.
  int factor;
  /// Mean density of every cell, and what is left of the sun's beam where its density is, over 4 pi.
  std::vector<float> density, beam;

  Lattice(const Vec3i& n, int voxels)
      : size(n),
        factor(voxels),
        density(std::size_t(n.x) * std::size_t(n.y) * std::size_t(n.z)),
        beam(density.size()) {}
  std::size_t index(int x, int y, int z) const {
    return (std::size_t(z) * std::size_t(size.y) + std::size_t(y)) * std::size_t(size.x) + std::size_t(x);
  }
  int longest() const { return std::max({size.x, size.y, size.z}); }
  // From sums of density, and of density times beam, to means.
  void finish(float samplesPerCell) {
    for (std::size_t i = 0; i != density.size(); ++i) {
      if (!(density[i] > 0)) continue;
      beam[i] /= density[i];
      density[i] /= samplesPerCell;
    }
  }
};

Lattice halved(const Lattice& fine) {
  const Vec3i n = fine.size;
  Lattice coarse({(n.x + 1) / 2, (n.y + 1) / 2, (n.z + 1) / 2}, 2 * fine.factor);
  for (int z = 0; z != n.z; ++z)
    for (int y = 0; y != n.y; ++y)
      for (int x = 0; x != n.x; ++x) {
        const std::size_t from = fine.index(x, y, z), to = coarse.index(x / 2, y / 2, z / 2);
        coarse.density[to] += fine.density[from];
        coarse.beam[to] += fine.density[from] * fine.beam[from];
      }
  coarse.finish(8);
  return coarse;
}

// Linear interpolation: cell i of `coarse` holds the cells 2 i and 2 i + 1.
std::vector<float> refined(const std::vector<float>& values, const Lattice& coarse, const Lattice& fine) {
  std::vector<float> result(fine.density.size());
  parallelFor(std::size_t(fine.size.z), 4, [&](std::size_t begin, std::size_t end) {
    const auto neighbour = [](int i, int count) {
      return std::clamp(i / 2 + (i % 2 ? 1 : -1), 0, count - 1);
    };
    for (int z = int(begin); z != int(end); ++z)
      for (int y = 0; y != fine.size.y; ++y)
        for (int x = 0; x != fine.size.x; ++x) {
          const int ox = neighbour(x, coarse.size.x), oy = neighbour(y, coarse.size.y),
                    oz = neighbour(z, coarse.size.z);
          const auto row = [&](int j, int k) {
            return 0.75f * values[coarse.index(x / 2, j, k)] + 0.25f * values[coarse.index(ox, j, k)];
          };
          const auto plane = [&](int k) { return 0.75f * row(y / 2, k) + 0.25f * row(oy, k); };
          result[fine.index(x, y, z)] = 0.75f * plane(z / 2) + 0.25f * plane(oz);
        }
  });
  return result;
}

// A copy of lattice values whose slowest axis is `last`.
struct Turned {
  Vec3i order, size;
  std::size_t stride[3];
  std::vector<float> values;

  Turned(const Vec3i& n, int last)
      : order(last == 0   ? Vec3i{1, 2, 0}
              : last == 1 ? Vec3i{0, 2, 1}
                          : Vec3i{0, 1, 2}),
        size{n[order.x], n[order.y], n[order.z]},
        values(std::size_t(n.x) * std::size_t(n.y) * std::size_t(n.z)) {
    const std::size_t plain[3] = {1, std::size_t(n.x), std::size_t(n.x) * std::size_t(n.y)};
    for (int axis = 0; axis != 3; ++axis) stride[axis] = plain[order[axis]];
  }
  std::size_t row(int y, int z) const {
    return (std::size_t(z) * std::size_t(size.y) + std::size_t(y)) * std::size_t(size.x);
  }
  void take(const std::vector<float>& from) {
    for (int z = 0; z != size.z; ++z)
      for (int y = 0; y != size.y; ++y) {
        const float* at = from.data() + std::size_t(z) * stride[2] + std::size_t(y) * stride[1];
        float* to = values.data() + row(y, z);
        for (int x = 0; x != size.x; ++x) to[x] = at[std::size_t(x) * stride[0]];
      }
  }
  void addTo(std::vector<float>& sum, float share, int beginY, int endY) const {
    for (int z = 0; z != size.z; ++z)
      for (int y = beginY; y < endY; ++y) {
        float* at = sum.data() + std::size_t(z) * stride[2] + std::size_t(y) * stride[1];
        const float* from = values.data() + row(y, z);
        for (int x = 0; x != size.x; ++x) at[std::size_t(x) * stride[0]] += share * from[x];
      }
  }
};

// Carries light through one lattice in all directions.
class Sweeper {
 public:
  // `inflow`: what comes in along each of the directions.
  Sweeper(const Lattice& lattice, float extinction, const std::vector<float>& inflow,
          const std::vector<Vec3f>& directions)
      : share_(1.0f / float(directions.size())) {
    std::vector<float> perLength(lattice.density);
    for (float& value : perLength) value *= extinction;
    for (int axis = 0; axis != 3; ++axis) {
      extinction_.emplace_back(lattice.size, axis).take(perLength);
      source_.emplace_back(lattice.size, axis);
      for (int side = 0; side != 2; ++side) sums_.emplace_back(lattice.size, axis);
    }
    for (std::size_t i = 0; i != directions.size(); ++i) {
      const Vec3f& d = directions[i];
      int axis = 0;
      for (int a = 1; a != 3; ++a)
        if (std::fabs(d[a]) > std::fabs(d[axis])) axis = a;
      passes_[axis * 2 + (d[axis] > 0)].push_back({d, inflow[i]});
    }
  }

  // Mean over directions of the light in every cell, whose own light is `source` per optical depth.
  void sweep(const std::vector<float>& source, std::vector<float>& mean) {
    parallelFor(3, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t axis = begin; axis != end; ++axis) source_[axis].take(source);
    });
    parallelFor(6, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t pass = begin; pass != end; ++pass) {
        Turned& sum = sums_[pass];
        std::fill(sum.values.begin(), sum.values.end(), 0.0f);
        for (const auto& [d, inflow] : passes_[pass])
          carry({d[sum.order.x], d[sum.order.y], d[sum.order.z]}, inflow, pass / 2, sum);
      }
    });
    mean.assign(source.size(), 0.0f);
    for (const Turned& sum : sums_)
      parallelFor(std::size_t(sum.size.y), 8,
                  [&](std::size_t begin, std::size_t end) { sum.addTo(mean, share_, int(begin), int(end)); });
  }

 private:
  // `d`: the way of the light in cells per world unit.
  void carry(const Vec3f& d, float inflow, std::size_t axis, Turned& sum) const {
    // Slices have a rim of cells through which light comes in.
    constexpr int rim = 2;
    const Vec3i n = sum.size;
    const float length = 1 / std::fabs(d.z);  // world units per slice
    const float du = -d.x * length, dv = -d.y * length;
    const int iu = int(std::floor(du)), iv = int(std::floor(dv));
    const float fu = du - float(iu), fv = dv - float(iv);
    const float w00 = (1 - fu) * (1 - fv), w10 = fu * (1 - fv), w01 = (1 - fu) * fv, w11 = fu * fv;
    const std::size_t width = std::size_t(n.x + 2 * rim);
    std::vector<float> before(width * std::size_t(n.y + 2 * rim), inflow), here = before;
    for (int slice = 0; slice != n.z; ++slice) {
      const int z = d.z > 0 ? slice : n.z - 1 - slice;
      for (int y = 0; y != n.y; ++y) {
        const float *a = before.data() + std::size_t(y + iv + rim) * width + std::size_t(iu + rim),
                    *b = a + width;
        const std::size_t row = sum.row(y, z);
        const float *extinction = extinction_[axis].values.data() + row,
                    *own = source_[axis].values.data() + row;
        float *out = here.data() + std::size_t(y + rim) * width + rim, *total = sum.values.data() + row;
        for (int x = 0; x < n.x; ++x) {
          const float in = w00 * a[x] + w10 * a[x + 1] + w01 * b[x] + w11 * b[x + 1];
          const float depth = std::min(length * extinction[x], 80.0f), excess = in - own[x];
          // (1 - exp(-depth)) / depth, by its series where the difference would lose its digits.
          const float thin = 1 - depth * (0.5f - depth * (1.0f / 6));
          const float mean = depth < 0.03f ? thin : (1 - expOfMinus(depth)) / depth;
          total[x] += own[x] + excess * mean;
          out[x] = in - excess * (depth * mean);
        }
      }
      std::swap(before, here);
    }
  }

  struct Way {
    Vec3f direction;
    float inflow;
  };

  float share_;
  std::vector<Turned> extinction_, source_, sums_;
  std::vector<Way> passes_[6];
};

// Anderson's acceleration of x = g(x), differences weighed by `weights`.
class Anderson {
 public:
  explicit Anderson(const std::vector<float>& weights) : weights_(weights) {}

  // Moves x, given g(x); returns the relative change |g - x| / |g| that was left.
  float step(std::vector<float>& x, const std::vector<float>& g) {
    const std::size_t n = x.size();
    if (!lastX_.empty()) {
      if (dx_.size() == kMemory) {
        std::rotate(dx_.begin(), dx_.begin() + 1, dx_.end());
        std::rotate(df_.begin(), df_.begin() + 1, df_.end());
      } else {
        dx_.emplace_back(n), df_.emplace_back(n);
      }
    }
    const std::size_t m = dx_.size();
    constexpr std::size_t columns = kMemory + 1, piece = 1 << 15;
    using Products = std::array<double, kMemory * columns + 2>;
    std::vector<Products> pieces((n + piece - 1) / piece);
    parallelFor(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p != end; ++p)
        for (std::size_t i = p * piece; i != std::min(n, (p + 1) * piece); ++i) {
          const float f = g[i] - x[i], weight = weights_[i];
          if (m > 0) dx_[m - 1][i] = x[i] - lastX_[i], df_[m - 1][i] = f - lastF_[i];
          if (weight == 0) continue;
          Products& sums = pieces[p];
          for (std::size_t r = 0; r != m; ++r) {
            const float mine = weight * df_[r][i];
            for (std::size_t c = 0; c != m; ++c) sums[r * columns + c] += double(mine * df_[c][i]);
            sums[r * columns + kMemory] += double(mine * f);
          }
          sums[kMemory * columns] += double(weight * std::fabs(f));
          sums[kMemory * columns + 1] += double(weight * g[i]);
        }
    });
    // Added in a fixed order, so that the sums do not depend on the threads.
    Products a{};
    for (const Products& sums : pieces)
      for (std::size_t k = 0; k != a.size(); ++k) a[k] += sums[k];
    const std::array<double, kMemory> share = solve(a, m);

    lastX_ = x;
    lastF_.resize(n);
    parallelFor(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin * piece; i != std::min(n, end * piece); ++i) {
        lastF_[i] = g[i] - x[i];
        float next = g[i];
        for (std::size_t r = 0; r != m; ++r) next -= float(share[r]) * (dx_[r][i] + df_[r][i]);
        x[i] = std::max(next, 0.0f);
      }
    });
    const double whole = a[kMemory * columns + 1];
    return whole > 0 ? float(a[kMemory * columns] / whole) : 0.0f;
  }

 private:
  // Least squares by the normal equations, a little damped.
  template <class Products>
  static std::array<double, kMemory> solve(Products a, std::size_t m) {
    constexpr std::size_t columns = kMemory + 1;
    std::array<double, kMemory> result{};
    for (std::size_t r = 0; r != m; ++r) a[r * columns + r] *= 1 + 1e-8;
    for (std::size_t r = 0; r != m; ++r)
      for (std::size_t below = r + 1; below != m; ++below) {
        if (!(a[r * columns + r] > 0)) continue;
        const double times = a[below * columns + r] / a[r * columns + r];
        for (std::size_t c = r; c != columns; ++c) a[below * columns + c] -= times * a[r * columns + c];
      }
    for (std::size_t r = m; r-- != 0;) {
      double rest = a[r * columns + kMemory];
      for (std::size_t c = r + 1; c != m; ++c) rest -= a[r * columns + c] * result[c];
      result[r] = a[r * columns + r] > 0 ? rest / a[r * columns + r] : 0;
    }
    return result;
  }

  const std::vector<float>& weights_;
  std::vector<float> lastX_, lastF_;
  std::vector<std::vector<float>> dx_, df_;
};

// Where the lattices of a volume lie: a brick of nothing around it.
struct Placement {
  Vec3i first, bricks;
  int factor = 1;

  Placement(const RenderVolume& volume, int longestSide) {
    const Box box = volume.indexBounds();
    first = Vec3i(box.min * (1.0f / BrickGrid::kBrick)) - Vec3i{1, 1, 1};
    bricks = Vec3i(box.size() * (1.0f / BrickGrid::kBrick)) + Vec3i{2, 2, 2};
    const int longest = std::max({bricks.x, bricks.y, bricks.z}) * BrickGrid::kBrick;
    while (factor < BrickGrid::kBrick && longest / factor > longestSide) factor *= 2;
  }
};

Lattice finestLattice(const RenderVolume& volume, const Placement& place, float extinction,
                      const ScatteredSource& source) {
  const BrickGrid& grid = volume.density();
  const int factor = place.factor, perBrick = BrickGrid::kBrick / factor;
  Lattice lattice(place.bricks * perBrick, factor);
  const std::vector<Vec3i>& occupied = volume.occupiedBricks();
  // The beam varies slowly enough for every other voxel where a cell has many.
  const int stride = factor > 2 ? 2 : 1;
  parallelFor(occupied.size(), 32, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i) {
      const Vec3i origin = (occupied[i] - place.first) * perBrick;
      const float* values = grid.brick(grid.poolIndex(occupied[i]));
      for (int z = 0; z < BrickGrid::kBrick; z += stride)
        for (int y = 0; y < BrickGrid::kBrick; y += stride)
          for (int x = 0; x < BrickGrid::kBrick; x += stride) {
            float rho = 0;
            for (int k = 0; k != stride * stride * stride; ++k)
              rho += std::max(
                  values[sampleOffset(x + k % stride, y + k / stride % stride, z + k / (stride * stride))],
                  0.0f);
            if (!(rho > 0)) continue;
            const std::size_t to =
                lattice.index(origin.x + x / factor, origin.y + y / factor, origin.z + z / factor);
            lattice.density[to] += rho;
            if (!source.column) continue;
            const Vec3f voxel = Vec3f(occupied[i] * BrickGrid::kBrick + Vec3i{x, y, z}) +
                                Vec3f{1, 1, 1} * (0.5f * float(stride - 1));
            const Vec3f world = grid.indexToWorld(voxel);
            const float depth = std::max(extinction * source.shadow * source.column(world), 0.0f);
            lattice.beam[to] +=
                rho * source.irradiance(world) * expOfMinus(std::min(depth, 80.0f)) / (4 * kPi);
          }
    }
  });
  lattice.finish(float(factor * factor * factor));
  return lattice;
}

// Mean density that light meets where there is any.
float typicalDensity(const Lattice& lattice) {
  double sum = 0, squares = 0;
  for (const float value : lattice.density) {
    sum += double(value);
    squares += double(value) * double(value);
  }
  return sum > 0 ? float(squares / sum) : 0.0f;
}

}  // namespace

Scattering Scattering::isotropic() const {
  const float g = std::max(meanCosine, 0.0f), left = 1 - albedo * g;
  return {extinction * left, albedo * (1 - g) / left, 0.0f};
}

ScatteredSource ScatteredSource::of(const LightVolume& sun) {
  ScatteredSource source;
  source.irradiance = [](const Vec3f&) { return 1.0f; };
  source.column = [&sun](const Vec3f& world) { return sun.columnDensity(world); };
  return source;
}

ScatteredSource ScatteredSource::evenSky() {
  ScatteredSource source;
  source.sky = [](const std::vector<Vec3f>& towards) { return std::vector<float>(towards.size(), 1.0f); };
  return source;
}

ScatteredLight::ScatteredLight(const RenderVolume& volume, const Scattering& scattering,
                               const LightVolume* sun, const Progress& progress)
    : ScatteredLight(volume, scattering, sun, Options{}, progress) {}

ScatteredLight::ScatteredLight(const RenderVolume& volume, const Scattering& scattering,
                               const LightVolume* sun, const Options& options, const Progress& progress)
    : ScatteredLight(volume, scattering, sun ? ScatteredSource::of(*sun) : ScatteredSource::evenSky(),
                     options, progress) {}

ScatteredLight::ScatteredLight(const RenderVolume& volume, const Scattering& scattering,
                               const ScatteredSource& source, const Options& options,
                               const Progress& progress) {
  require(options.directions >= 6 && options.longestSide >= 8 && options.sweeps >= 1,
          "scattered light: needs at least 6 directions, 8 nodes and a sweep");
  // Spirals that are even over the sphere.
  std::vector<Vec3f> ways, towards;
  for (int i = 0; i != options.directions; ++i) {
    const float y = 1 - (2 * float(i) + 1) / float(options.directions), angle = 2.39996323f * float(i);
    const float r = std::sqrt(1 - y * y);
    ways.push_back({r * std::cos(angle), y, r * std::sin(angle)});
    towards.push_back(-ways.back());
  }
  const std::vector<float> inflow =
      source.sky ? source.sky(towards) : std::vector<float>(towards.size(), 0.0f);
  float meanInflow = 0;
  for (const float value : inflow) meanInflow += value;
  meanInflow /= float(inflow.size());
  values_ = {meanInflow};
  if (volume.isEmpty()) return;
  Scattering even = scattering.isotropic();

  const BrickGrid& grid = volume.density();
  const Placement place(volume, options.longestSide);
  std::vector<Lattice> levels{finestLattice(volume, place, even.extinction, source)};
  while (levels[0].longest() > options.longestSide) levels[0] = halved(levels[0]);
  size_ = levels[0].size;
  const int factor = levels[0].factor;
  const float scale = 1.0f / float(factor);
  const Vec3f middle = Vec3f(place.first * BrickGrid::kBrick) + Vec3f{1, 1, 1} * (0.5f * float(factor - 1));
  worldToLattice_ = {Mat3f::scaling(scale) * grid.worldToIndex.linear,
                     (grid.worldToIndex.translation - middle) * scale};
  const float deepest = grid.voxelSize * float(factor) * typicalDensity(levels[0]);
  if (deepest * even.extinction > kDeepestCell) even.extinction = kDeepestCell / deepest;
  // Without scattering one sweep tells all.
  if (even.albedo > 0)
    while (levels.back().longest() > kCoarsest) levels.push_back(halved(levels.back()));

  for (std::size_t level = levels.size(); level-- != 0;) {
    const Lattice& lattice = levels[level];
    std::vector<Vec3f> directions;
    for (const Vec3f& way : ways)
      directions.push_back(grid.worldToIndex.linear * way * (1.0f / float(lattice.factor)));
    Sweeper sweeper(lattice, even.extinction, inflow, directions);
    Anderson anderson(lattice.density);
    std::vector<float> light = level + 1 == levels.size()
                                   ? std::vector<float>(lattice.density.size(), meanInflow)
                                   : refined(values_, levels[level + 1], lattice);
    std::vector<float> own(light.size());
    const int most = level == 0 ? options.sweeps : kCoarseSweeps;
    for (int sweep = 1;; ++sweep) {
      progress.check();
      for (std::size_t i = 0; i != light.size(); ++i) own[i] = even.albedo * (light[i] + lattice.beam[i]);
      sweeper.sweep(own, values_);
      if (sweep == most || even.albedo == 0 || anderson.step(light, values_) < options.tolerance) break;
      if (level == 0) progress.advance(double(sweep) / most);
    }
  }
  if (source.sky) {
    const float most = *std::max_element(inflow.begin(), inflow.end());
    for (float& value : values_) value = std::min(value, most);
  }
}

void ScatteredLight::scale(float factor) {
  for (float& value : values_) value *= factor;
}

float ScatteredLight::at(const Vec3f& world) const {
  const Vec3f p = worldToLattice_(world);
  Vec3i cell;
  Vec3f f;
  for (int axis = 0; axis != 3; ++axis) {
    const float x = std::clamp(p[axis], 0.0f, float(size_[axis] - 1));
    cell[axis] = std::min(int(x), std::max(size_[axis] - 2, 0));
    f[axis] = x - float(cell[axis]);
  }
  float sum = 0;
  for (int corner = 0; corner != 8; ++corner) {
    const Vec3i d{corner & 1, corner >> 1 & 1, corner >> 2};
    const Vec3i node = min(cell + d, size_ - Vec3i{1, 1, 1});
    sum += (d.x ? f.x : 1 - f.x) * (d.y ? f.y : 1 - f.y) * (d.z ? f.z : 1 - f.z) *
           values_[(std::size_t(node.z) * std::size_t(size_.y) + std::size_t(node.y)) * std::size_t(size_.x) +
                   std::size_t(node.x)];
  }
  return sum;
}

ScatteredLight::Bytes ScatteredLight::estimateBytes(const RenderVolume& volume, int longestSide) {
  if (volume.isEmpty()) return {};
  const Placement place(volume, longestSide);
  const double perBrick = double(BrickGrid::kBrick) / place.factor;
  const double nodes =
      double(place.bricks.x) * place.bricks.y * place.bricks.z * perBrick * perBrick * perBrick;
  // Two arrays of the lattice, twelve of the sweeps, twelve of the acceleration, and the light itself.
  return {30.0 * sizeof(float) * nodes, sizeof(float) * nodes};
}

}  // namespace nephele
