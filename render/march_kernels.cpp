// The inner loop of the renderer: density, light and opacity along a ray.
//
// Per step:  dT = exp(-sigma ds);  C += T (1 - dT) (sum of lights);  T *= dT,  written as T (1 - dT) =
// T_before - T_after with T = exp(-optical depth so far), so that the weights of a ray add up to its opacity
// exactly, whatever the steps are.
//
// Steps are gathered into blocks of 16 that run across bricks. A block is looked up as vectors: brick table,
// then the eight corners, in the density, in every sun's column densities and in the sky's visibility. Octave
// n of a sun needs exp(-depth / 2^n): one exponential for the last octave, squared for each one before it.
//
// Limits: pool bricks are indexed by 32 bits (RenderVolume refuses more).
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/march_kernels.cpp"
#include "render/march_kernels.h"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "hwy/contrib/math/math-inl.h"
#include "levelset/brick_grid.h"
#include "render/brick_walk.h"
#include "render/light_volume.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int kBlock = 16;
using Lanes = hn::CappedTag<float, kBlock>;
using IntLanes = hn::RebindToSigned<Lanes>;
using Floats = hn::Vec<Lanes>;
using Ints = hn::Vec<IntLanes>;

struct Point {
  Floats x, y, z;
};

HWY_INLINE Point pointAt(const LatticeRay& ray, Floats s) {
  const Lanes d;
  return {hn::MulAdd(s, hn::Set(d, ray.direction.x), hn::Set(d, ray.origin.x)),
          hn::MulAdd(s, hn::Set(d, ray.direction.y), hn::Set(d, ray.origin.y)),
          hn::MulAdd(s, hn::Set(d, ray.direction.z), hn::Set(d, ray.origin.z))};
}

// Values between the nodes around (x, y, z), all >= 0, of a block of nodes that starts at `base`.
HWY_INLINE Floats trilinear(const float* HWY_RESTRICT values, Ints base, Point p, int strideY, int strideZ) {
  const Lanes d;
  const IntLanes i;
  const Ints ix = hn::ConvertTo(i, p.x), iy = hn::ConvertTo(i, p.y), iz = hn::ConvertTo(i, p.z);
  const Floats fx = hn::Sub(p.x, hn::ConvertTo(d, ix)), fy = hn::Sub(p.y, hn::ConvertTo(d, iy)),
               fz = hn::Sub(p.z, hn::ConvertTo(d, iz));
  const Ints at =
      hn::Add(hn::Add(base, ix), hn::Add(hn::Mul(iy, hn::Set(i, strideY)), hn::Mul(iz, hn::Set(i, strideZ))));
  const auto edge = [&](int offset) HWY_ATTR {
    const Floats a = hn::GatherIndex(d, values + offset, at), b = hn::GatherIndex(d, values + offset + 1, at);
    return hn::MulAdd(fx, hn::Sub(b, a), a);
  };
  const Floats near0 = edge(0), near1 = edge(strideY), far0 = edge(strideZ), far1 = edge(strideZ + strideY);
  const Floats nearFace = hn::MulAdd(fy, hn::Sub(near1, near0), near0);
  const Floats farFace = hn::MulAdd(fy, hn::Sub(far1, far0), far0);
  return hn::MulAdd(fz, hn::Sub(farFace, nearFace), nearFace);
}

template <int kWidth, int kBefore>
HWY_INLINE Floats sampleBricks(const MarchScene::Bricks& bricks, Point p) {
  const Lanes d;
  const IntLanes i;
  const Floats zero = hn::Zero(d), size = hn::Set(d, 8.0f), eighth = hn::Set(d, 0.125f);
  // Just under 8, so that a point on the far face still lies in the last cell.
  const Floats last = hn::Set(d, 7.9999995f);
  const auto split = [&](Floats x, int count, Floats& local) HWY_ATTR {
    const Floats brick = hn::Min(hn::Max(hn::Floor(hn::Mul(x, eighth)), zero), hn::Set(d, float(count - 1)));
    local = hn::Min(hn::Max(hn::NegMulAdd(brick, size, x), zero), last);
    return hn::ConvertTo(i, brick);
  };
  Point local;
  const Ints bx = split(p.x, bricks.count.x, local.x), by = split(p.y, bricks.count.y, local.y),
             bz = split(p.z, bricks.count.z, local.z);
  const Ints entry =
      hn::Add(hn::Mul(hn::Add(hn::Mul(bz, hn::Set(i, bricks.count.y)), by), hn::Set(i, bricks.count.x)), bx);
  const Ints pool = hn::GatherIndex(i, bricks.table, entry);
  constexpr int plane = kWidth * kWidth;
  const Ints base =
      hn::Add(hn::Mul(pool, hn::Set(i, plane * kWidth)), hn::Set(i, kBefore * (plane + kWidth + 1)));
  return trilinear(bricks.values, base, local, kWidth, plane);
}

HWY_INLINE Floats sampleSky(const MarchScene& scene, Point p) {
  const Lanes d;
  const auto clamped = [&](Floats x, int count) HWY_ATTR {
    return hn::Min(hn::Max(x, hn::Zero(d)), hn::Set(d, float(count - 1) - 1e-3f));
  };
  const Point q{clamped(p.x, scene.skySize.x), clamped(p.y, scene.skySize.y), clamped(p.z, scene.skySize.z)};
  return trilinear(scene.sky, hn::Zero(IntLanes()), q, scene.skySize.x, scene.skySize.x * scene.skySize.y);
}

// One ray's march: collects steps, and adds a block of them at a time.
class Marcher {
 public:
  Marcher(const MarchScene& scene, const MarchRay& ray, MarchResult& result)
      : scene_(scene), ray_(ray), result_(result) {}

  // `count` steps of length `ds` from `start` on. False once the ray is as good as opaque.
  bool take(float start, float ds, int count) {
    const Lanes d;
    const int lanes = int(hn::Lanes(d));
    start += ray_.jitter * ds;
    while (count > 0) {
      // Whole vectors, whatever room there is: the blocks have as much again behind them.
      for (int i = 0; i < kBlock; i += lanes) {
        const Floats index = hn::Iota(d, float(i));
        hn::StoreU(hn::MulAdd(index, hn::Set(d, ds), hn::Set(d, start)), d, s_ + count_ + i);
        hn::StoreU(hn::Set(d, ds), d, ds_ + count_ + i);
      }
      const int taken = std::min(count, kBlock - count_);
      count_ += taken;
      count -= taken;
      start += float(taken) * ds;
      if (count_ == kBlock && !flush()) return false;
    }
    return true;
  }

  void finish() {
    if (count_ > 0) flush();
    result_.opticalDepth = depth_;
  }

 private:
  // Adds the steps collected. False once the ray is as good as opaque.
  bool flush() {
    const Lanes d;
    const std::size_t lanes = hn::Lanes(d);
    const int used = count_;
    for (int i = used; i != kBlock; ++i) s_[i] = s_[used - 1], ds_[i] = 0.0f;
    count_ = 0;
    result_.samples += std::uint32_t(used);

    alignas(64) float depth[kBlock];
    const Floats extinction = hn::Set(d, scene_.extinction);
    for (std::size_t i = 0; i < kBlock; i += lanes) {
      const Floats s = hn::Load(d, s_ + i);
      const Floats density = hn::Max(
          sampleBricks<BrickGrid::kWidth, BrickGrid::kBefore>(scene_.density, pointAt(ray_.density, s)),
          hn::Zero(d));
      hn::Store(hn::Mul(hn::Mul(density, extinction), hn::Load(d, ds_ + i)), d, depth + i);
    }
    alignas(64) float after[kBlock];
    const float start = depth_;
    for (int i = 0; i != kBlock; ++i) after[i] = depth_ += depth[i];
    if (depth_ == start) return true;
    if (start <= detail::kVisibleDepth && depth_ > detail::kVisibleDepth) {
      int first = 0;
      while (after[first] <= detail::kVisibleDepth) ++first;
      result_.distance = ray_.start + s_[first];
    }

    alignas(64) float through[kBlock + 1];
    through[0] = through_;
    for (std::size_t i = 0; i < kBlock; i += lanes) {
      const Floats tau = hn::Min(hn::Load(d, after + i), hn::Set(d, 80.0f));
      hn::StoreU(hn::Exp(d, hn::Neg(tau)), d, through + 1 + i);
    }
    through_ = through[kBlock];
    for (std::size_t i = 0; i < kBlock; i += lanes) {
      const Floats weight = hn::Sub(hn::LoadU(d, through + i), hn::LoadU(d, through + i + 1));
      if (hn::AllTrue(d, hn::Eq(weight, hn::Zero(d)))) continue;
      light(hn::Load(d, s_ + i), weight);
    }
    return through_ > scene_.cutoff;
  }

  void light(Floats s, Floats weight) {
    const Lanes d;
    const float least = scene_.extinction / float(1 << (scene_.octaves - 1));
    for (std::size_t sun = 0; sun != scene_.suns.size(); ++sun) {
      const Floats column =
          sampleBricks<LightVolume::kWidth, 0>(scene_.suns[sun], pointAt(ray_.suns[sun], s));
      const Floats last = hn::Min(hn::Mul(hn::Max(column, hn::Zero(d)), hn::Set(d, least)),
                                  hn::Set(d, 80.0f / float(1 << (scene_.octaves - 1))));
      const Floats first = hn::Exp(d, hn::Neg(last));
      for (int c = 0; c != scene_.colours; ++c) {
        Floats power = first, sum = hn::Zero(d);
        for (int n = scene_.octaves - 1; n >= 0; --n) {
          sum = hn::MulAdd(power, hn::Set(d, ray_.weight[sun][c][n]), sum);
          power = hn::Mul(power, power);
        }
        result_.suns[sun][c] += hn::GetLane(hn::SumOfLanes(d, hn::Mul(sum, weight)));
      }
    }
    if (scene_.sky) {
      const Floats visible = sampleSky(scene_, pointAt(ray_.sky, s));
      result_.sky += hn::GetLane(hn::SumOfLanes(d, hn::Mul(visible, weight)));
    }
  }

  const MarchScene& scene_;
  const MarchRay& ray_;
  MarchResult& result_;
  alignas(64) float s_[2 * kBlock];
  alignas(64) float ds_[2 * kBlock];
  int count_ = 0;
  float depth_ = 0.0f;
  float through_ = 1.0f;
};

void marchBatch(const MarchScene& scene, const MarchRay* rays, MarchResult* results, std::size_t count) {
  for (std::size_t i = 0; i != count; ++i) {
    results[i] = {};
    results[i].distance = std::numeric_limits<float>::infinity();
    Marcher marcher(scene, rays[i], results[i]);
    detail::forEachRun(scene, rays[i], [&](float s, float ds, int n) { return marcher.take(s, ds, n); });
    marcher.finish();
  }
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "modeling/error.h"

namespace nephele {

HWY_EXPORT(marchBatch);

void marchRays(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results) {
  require(rays.size() == results.size(), "march: as many results as rays are needed");
  HWY_DYNAMIC_DISPATCH(marchBatch)(scene, rays.data(), results.data(), rays.size());
}

namespace {

float sample(const float* block, const Vec3f& p, int strideY, int strideZ) {
  const Vec3i cell{int(p.x), int(p.y), int(p.z)};
  const Vec3f f = p - Vec3f(cell);
  const float* at = block + cell.z * strideZ + cell.y * strideY + cell.x;
  const auto edge = [&](int offset) { return at[offset] + f.x * (at[offset + 1] - at[offset]); };
  const float near = edge(0) + f.y * (edge(strideY) - edge(0));
  const float far = edge(strideZ) + f.y * (edge(strideZ + strideY) - edge(strideZ));
  return near + f.z * (far - near);
}

float sample(const MarchScene::Bricks& bricks, const Vec3f& p, int width, int before) {
  Vec3i brick;
  Vec3f local;
  for (int axis = 0; axis != 3; ++axis) {
    brick[axis] = std::clamp(int(std::floor(p[axis] * 0.125f)), 0, bricks.count[axis] - 1);
    local[axis] = std::clamp(p[axis] - 8.0f * float(brick[axis]), 0.0f, 7.9999995f);
  }
  const std::size_t pool = std::size_t(
      bricks.table[(std::size_t(brick.z) * bricks.count.y + std::size_t(brick.y)) * bricks.count.x +
                   std::size_t(brick.x)]);
  const int plane = width * width;
  return sample(bricks.values + pool * std::size_t(plane * width) + before * (plane + width + 1), local,
                width, plane);
}

// One step; false once the ray is as good as opaque.
bool stepScalar(const MarchScene& scene, const MarchRay& ray, float s, float ds, MarchResult& result) {
  const auto at = [s](const LatticeRay& line) { return line.origin + line.direction * s; };
  ++result.samples;
  const float density =
      std::max(sample(scene.density, at(ray.density), BrickGrid::kWidth, BrickGrid::kBefore), 0.0f);
  if (density == 0) return true;
  const float before = std::exp(-std::min(result.opticalDepth, 80.0f));
  result.opticalDepth += scene.extinction * density * ds;
  const float after = std::exp(-std::min(result.opticalDepth, 80.0f)), weight = before - after;
  if (std::isinf(result.distance) && result.opticalDepth > detail::kVisibleDepth)
    result.distance = ray.start + s;
  for (std::size_t sun = 0; sun != scene.suns.size(); ++sun) {
    const float column =
        scene.extinction * std::max(sample(scene.suns[sun], at(ray.suns[sun]), LightVolume::kWidth, 0), 0.0f);
    for (int c = 0; c != scene.colours; ++c)
      for (int n = 0; n != scene.octaves; ++n)
        result.suns[sun][c] +=
            weight * ray.weight[sun][c][n] * std::exp(-std::min(column, 80.0f) / float(1 << n));
  }
  if (scene.sky) {
    Vec3f p = at(ray.sky);
    for (int axis = 0; axis != 3; ++axis)
      p[axis] = std::clamp(p[axis], 0.0f, float(scene.skySize[axis] - 1) - 1e-3f);
    result.sky += weight * sample(scene.sky, p, scene.skySize.x, scene.skySize.x * scene.skySize.y);
  }
  return after > scene.cutoff;
}

}  // namespace

void marchRaysScalar(const MarchScene& scene, std::span<const MarchRay> rays,
                     std::span<MarchResult> results) {
  require(rays.size() == results.size(), "march: as many results as rays are needed");
  for (std::size_t i = 0; i != rays.size(); ++i) {
    results[i] = {};
    results[i].distance = std::numeric_limits<float>::infinity();
    detail::forEachRun(scene, rays[i], [&](float start, float ds, int count) {
      for (int n = 0; n != count; ++n)
        if (!stepScalar(scene, rays[i], start + (float(n) + rays[i].jitter) * ds, ds, results[i]))
          return false;
      return true;
    });
  }
}

}  // namespace nephele

#endif  // HWY_ONCE
