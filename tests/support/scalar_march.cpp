// The march sample by sample: plain sums, in the order of the formulas.
#include "tests/support/scalar_march.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/light/light_volume.h"
#include "nephele/render/march/detail/march_runs.h"
#include "nephele/render/volume/brick_walk.h"

namespace nephele::test {

namespace {

float sample(const float* block, const Vec3f& p, int strideX, int strideY, int strideZ) {
  const Vec3i cell{int(p.x), int(p.y), int(p.z)};
  const Vec3f f = p - Vec3f(cell);
  const float* at = block + cell.z * strideZ + cell.y * strideY + cell.x * strideX;
  const auto edge = [&](int offset) { return at[offset] + f.x * (at[offset + strideX] - at[offset]); };
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
  return sample(bricks.values + pool * std::size_t(plane * width) + before * (plane + width + 1), local, 1,
                width, plane);
}

float localColumn(const MarchScene::Local& light, const MarchRay::Local& line, const Vec3f& q) {
  const Vec3f size{std::fabs(q.x), std::fabs(q.y), std::fabs(q.z)};
  const int axis = light.faces.size() == 1                ? light.faces[0].axis
                   : size.x >= size.y && size.x >= size.z ? 0
                   : size.y >= size.z                     ? 1
                                                          : 2;
  for (const MarchScene::Local::Face& face : light.faces) {
    if (face.axis != axis || !(q[axis] * face.side > 0)) continue;
    const float depth = std::max(q[axis] * face.side, light.least);
    const Vec3f p{q[(axis + 1) % 3] * face.perTangent / depth, q[(axis + 2) % 3] * face.perTangent / depth,
                  depth * face.perDepth};
    return sample(face, p + line.shift - face.corner, LightVolume::kWidth, 0);
  }
  return 0.0f;
}

// The light of a local over one step: see Marcher.
void addLocal(const MarchScene& scene, const MarchRay& ray, std::size_t index, float s, float ds,
              const float (&weight)[3], float (&result)[3]) {
  const MarchScene::Local& light = scene.locals[index];
  const MarchRay::Local& line = ray.locals[index];
  const double length = double(std::max(ds, light.least)), away = std::sqrt(double(line.distance2));
  const double along = double(s) - double(line.closest);
  const double first = along - double(ray.jitter) * length, last = first + length;
  const double r = std::hypot(along, away), a = std::atan2(first, away), b = std::atan2(last, away);
  double decay = 1;
  if (light.decay == 2)
    decay = light.decayStart > 0 && r < double(light.decayStart)
                ? 1 / (double(light.decayStart) * double(light.decayStart))
                : (b - a) / (away * length);
  if (light.decay == 1) decay = 1 / std::max(r, double(std::max(light.decayStart, light.least)));
  const Vec3f q = line.frame.origin + line.frame.direction * s;
  if (light.hasCone) {
    const float c = dot(q, light.axis) / std::max(float(r), light.least);
    const float t = std::clamp((c - light.outerCosine) * light.perCosine, 0.0f, 1.0f);
    decay *= double(t * t * (3 - 2 * t));
  }
  const float column = scene.extinction * std::max(localColumn(light, line, q), 0.0f);
  constexpr int nodes = MarchScene::Local::kPhaseNodes;
  const double sine = std::sin((a + b) / 2);
  const float place = float(std::sqrt(std::clamp((1 + sine) / 2, 0.0, 1.0))) * (float(nodes) - 0.001f);
  const int node = int(place);
  for (int n = 0; n != scene.octaves; ++n) {
    const float* table = light.phase + n * (nodes + 1) + node;
    const float phase = table[0] + (place - float(node)) * (table[1] - table[0]);
    for (int c = 0; c != scene.colours; ++c)
      result[c] += weight[c] * light.albedo[c] * phase * float(decay) *
                   std::exp(-std::min(
                       column * scene.attenuation[n] * scene.extinctionColour[c] * light.shadow[c], 80.0f));
  }
}

// One step; false once the ray is as good as opaque.
bool stepScalar(const MarchScene& scene, const MarchRay& ray, float s, float ds, MarchResult& result) {
  const auto at = [s](const LatticeRay& line) { return line.origin + line.direction * s; };
  ++result.samples;
  const float density =
      std::max(sample(scene.density, at(ray.density), BrickGrid::kWidth, BrickGrid::kBefore), 0.0f);
  if (density == 0 && !scene.emission.table) return true;
  const float depthBefore = result.opticalDepth;
  result.opticalDepth += scene.extinction * density * ds;
  std::size_t cursor = 0;
  const float begin = ray.start + s - ray.jitter * ds;
  const float seen = ray.holdout.empty() ? 1.0f
                                         : ray.holdout.seen(begin * ray.cosine, (begin + ds) * ray.cosine,
                                                            scene.extinction * density * ds, cursor);
  const auto through = [&](float depth, int c) {
    return std::exp(-std::min(depth * scene.extinctionColour[c], 80.0f));
  };
  const auto threeAt = [&](const MarchScene::ColourBricks& bricks, int c) {
    return std::max(sample({bricks.values[c], bricks.table, bricks.count}, at(ray.density), BrickGrid::kWidth,
                           BrickGrid::kBefore),
                    0.0f);
  };
  float weight[3], after = 0.0f;
  for (int c = 0; c != 3; ++c) {
    const float before = through(depthBefore, c), behind = through(result.opticalDepth, c);
    weight[c] = (before - behind) * seen;
    result.heldOpacity[c] += weight[c];
    after = std::max(after, behind);
    if (scene.emission.table) {
      const double t = double(scene.extinction) * density * ds * scene.extinctionColour[c];
      const double mean = t > 0 ? double(before) * -std::expm1(-t) / t : double(before);
      result.emission[c] +=
          scene.extinction * scene.emissionScale * ds * threeAt(scene.emission, c) * float(mean) * seen;
    }
    if (scene.colour.table) weight[c] *= density > 0 ? threeAt(scene.colour, c) / density : 0.0f;
  }
  const float* held = result.heldOpacity;
  if (std::isinf(result.distance) &&
      (ray.holdout.empty() ? result.opticalDepth > detail::kVisibleDepth
                           : held[0] + held[1] + held[2] > 3 * detail::kVisibleOpacity))
    result.distance = ray.start + s;
  for (std::size_t sun = 0; sun != scene.suns.size(); ++sun) {
    const float column =
        scene.extinction * std::max(sample(scene.suns[sun], at(ray.suns[sun]), LightVolume::kWidth, 0), 0.0f);
    for (int c = 0; c != scene.colours; ++c)
      for (int n = 0; n != scene.octaves; ++n)
        result.suns[sun][c] += weight[c] * ray.weight[sun][c][n] *
                               std::exp(-std::min(column * scene.attenuation[n] * scene.extinctionColour[c] *
                                                      scene.suns[sun].shadow[c],
                                                  80.0f));
  }
  for (std::size_t i = 0; i != scene.locals.size(); ++i)
    addLocal(scene, ray, i, s, ds, weight, result.suns[scene.suns.size() + i]);
  for (const MarchScene::Scattered& lattice : scene.scattered) {
    const Vec3i size = scene.scatteredSize;
    Vec3f p = at(ray.scattered);
    for (int axis = 0; axis != 3; ++axis) p[axis] = std::clamp(p[axis], 0.0f, float(size[axis] - 1) - 1e-3f);
    for (int n = 0; n != lattice.count; ++n)
      result.of(lattice.kinds[n]) +=
          weight[lattice.kinds[n].part] * sample(lattice.nodes + n, p, 2, 2 * size.x, 2 * size.x * size.y);
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
    const auto walk = [&](auto&& visit) {
      detail::walkBricks(scene, rays[i].density, rays[i].length, [&](float s0, float s1, std::int32_t pool) {
        return visit(s0, s1, scene.ranges[pool]);
      });
    };
    const auto step = [&](float begin, float ds) {
      return stepScalar(scene, rays[i], begin + rays[i].jitter * ds, ds, results[i]);
    };
    struct Take {
      const decltype(step)& one;

      bool operator()(float start, float ds, int count, float) const {
        for (int n = 0; n != count; ++n)
          if (!one(start + float(n) * ds, ds)) return false;
        return true;
      }
      bool operator()(const detail::GrowingSteps& steps, float) const {
        for (int n = 0; n != steps.count; ++n) {
          const float begin = steps.placeOf(float(n));
          if (!one(begin, steps.placeOf(float(n + 1)) - begin)) return false;
        }
        return true;
      }
    };
    detail::forEachRun(scene, rays[i], detail::StepGrowth(scene), walk, Take{step});
  }
}

}  // namespace nephele::test
