// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_LOCAL_LIGHT) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_LOCAL_LIGHT
#undef NEPHELE_LOCAL_LIGHT
#else
#define NEPHELE_LOCAL_LIGHT
#endif

#include <hwy/highway.h>

#include "hwy/contrib/math/math-inl.h"
#include "nephele/render/light/light_volume.h"
#include "nephele/render/march/detail/march_bricks.h"
#include "nephele/render/march/detail/march_coded_bricks.h"
#include "nephele/render/march/detail/march_lattice.h"
#include "nephele/render/march/march_kernels.h"

/// Lights at a place, as the march sees them a vector of steps at a time.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

// Density between a light at a place and points of the ray.
HWY_INLINE Floats localColumn(const MarchScene::Local& light, const MarchRay::Local& line, Floats s) {
  const Lanes d;
  const Point q = pointAt(line.frame, s);
  const Floats x = hn::Abs(q.x), y = hn::Abs(q.y), z = hn::Abs(q.z);
  Floats column = hn::Zero(d);
  for (const MarchScene::Local::Face& face : light.faces) {
    const Floats u = face.axis == 0   ? q.y
                     : face.axis == 1 ? q.z
                                      : q.x,
                 v = face.axis == 0   ? q.z
                     : face.axis == 1 ? q.x
                                      : q.y,
                 w = hn::Mul(face.axis == 0   ? q.x
                             : face.axis == 1 ? q.y
                                              : q.z,
                             hn::Set(d, face.side));
    const auto inFront = hn::Gt(w, hn::Zero(d));
    const auto mine = light.faces.size() == 1 ? inFront
                      : face.axis == 0        ? hn::And(inFront, hn::And(hn::Ge(x, y), hn::Ge(x, z)))
                      : face.axis == 1        ? hn::And(inFront, hn::And(hn::Gt(y, x), hn::Ge(y, z)))
                                              : hn::And(inFront, hn::And(hn::Gt(z, x), hn::Gt(z, y)));
    if (hn::AllFalse(d, mine)) continue;
    const Floats depth = hn::Max(w, hn::Set(d, light.least)),
                 scale = hn::Div(hn::Set(d, face.perTangent), depth);
    const Point p{hn::Sub(hn::MulAdd(u, scale, hn::Set(d, line.shift.x)), hn::Set(d, face.corner.x)),
                  hn::Sub(hn::MulAdd(v, scale, hn::Set(d, line.shift.y)), hn::Set(d, face.corner.y)),
                  hn::Sub(hn::MulAdd(depth, hn::Set(d, face.perDepth), hn::Set(d, line.shift.z)),
                          hn::Set(d, face.corner.z))};
    column = hn::IfThenElse(mine, sampleBricks<LightVolume::kWidth, 0>(face, p), column);
  }
  return column;
}

// Adds the light of a light at a place that steps of one weight, or of one for each colour, send to the eye.
// Within a step distance and angle change as the light goes by: taken are
// the mean of 1 / r^2, which is the angle that the step fills as seen from the light over its length and
// the distance of its line, and the phase function half way along that angle.
template <int kColours>
void addLocal(const MarchScene& scene, const MarchRay& ray, std::size_t index, float jitter, Floats s,
              Floats ds, const Floats (&weight)[kColours], MarchResult& into) {
  const Lanes d;
  const MarchScene::Local& light = scene.locals[index];
  const MarchRay::Local& line = ray.locals[index];
  const Floats least = hn::Set(d, light.least), one = hn::Set(d, 1.0f), zero = hn::Zero(d);
  const Floats length = hn::Max(ds, least), away2 = hn::Set(d, line.distance2), away = hn::Sqrt(away2);
  const Floats along = hn::Sub(s, hn::Set(d, line.closest));
  const Floats first = hn::NegMulAdd(hn::Set(d, jitter), length, along), last = hn::Add(first, length);
  const Floats r = hn::Sqrt(hn::MulAdd(along, along, away2));
  Floats share = one;
  {
    Floats decay = one;
    const Floats start = hn::Set(d, light.decayStart);
    if (light.decay == 2) {
      const Floats area = hn::Mul(away, length), x = hn::MulAdd(first, last, away2);
      const Floats tangent = hn::Div(area, hn::IfThenElse(hn::Eq(x, zero), hn::Set(d, 1e-30f), x));
      const Floats acute = hn::Atan(d, tangent);
      const Floats angle = hn::IfThenElse(hn::Lt(x, zero), hn::Add(acute, hn::Set(d, 3.14159265f)), acute);
      decay = hn::Div(angle, area);
      if (light.decayStart > 0)
        decay = hn::IfThenElse(hn::Lt(r, start), hn::Div(one, hn::Mul(start, start)), decay);
    } else if (light.decay == 1) {
      decay = hn::Div(one, hn::Max(r, hn::Max(start, least)));
    }
    const Point q = pointAt(line.frame, s);
    if (light.hasCone) {
      const Floats c = hn::Div(
          hn::MulAdd(q.x, hn::Set(d, light.axis.x),
                     hn::MulAdd(q.y, hn::Set(d, light.axis.y), hn::Mul(q.z, hn::Set(d, light.axis.z)))),
          hn::Max(r, least));
      const Floats t = hn::Min(
          hn::Max(hn::Mul(hn::Sub(c, hn::Set(d, light.outerCosine)), hn::Set(d, light.perCosine)), zero),
          one);
      decay = hn::Mul(decay, hn::Mul(hn::Mul(t, t), hn::NegMulAdd(hn::Set(d, 2.0f), t, hn::Set(d, 3.0f))));
      if (hn::AllTrue(d, hn::Eq(decay, zero))) return;
    }
    share = decay;
  }
  const Floats depth = hn::Mul(hn::Max(localColumn(light, line, s), zero), hn::Set(d, scene.extinction));

  const Floats a = hn::Div(one, hn::Sqrt(hn::MulAdd(first, first, away2))),
               b = hn::Div(one, hn::Sqrt(hn::MulAdd(last, last, away2)));
  const Floats across = hn::Mul(away, hn::Add(a, b)), forward = hn::MulAdd(first, a, hn::Mul(last, b));
  const Floats norm = hn::Sqrt(hn::MulAdd(across, across, hn::Mul(forward, forward)));
  const Floats sine = hn::Div(forward, hn::Max(norm, hn::Set(d, 1e-30f)));
  const Floats place =
      hn::Mul(hn::Sqrt(hn::Min(hn::Max(hn::Mul(hn::Add(one, sine), hn::Set(d, 0.5f)), zero), one)),
              hn::Set(d, float(MarchScene::Local::kPhaseNodes) - 0.001f));
  const IntLanes i;
  const Ints node = hn::ConvertTo(i, place);
  const Floats part = hn::Sub(place, hn::ConvertTo(d, node));

  float* result = into.suns[scene.suns.size() + index];
  for (int n = 0; n != scene.octaves; ++n) {
    const float* table = light.phase + n * (MarchScene::Local::kPhaseNodes + 1);
    const Floats p0 = hn::GatherIndex(d, table, node), p1 = hn::GatherIndex(d, table + 1, node);
    const Floats lit = hn::Mul(hn::MulAdd(part, hn::Sub(p1, p0), p0), share);
    const auto seen = [&](float extinction, Floats of) HWY_ATTR {
      const Floats left = hn::Min(hn::Mul(depth, hn::Set(d, extinction)), hn::Set(d, 80.0f));
      return hn::GetLane(hn::SumOfLanes(d, hn::Mul(hn::Mul(expOfMinus(left), lit), of)));
    };
    if constexpr (kColours == 1) {
      const float sum = seen(scene.attenuation[n] * light.shadow[0], weight[0]);
      for (int c = 0; c != scene.colours; ++c) result[c] += sum * light.albedo[c];
    } else {
      for (int c = 0; c != kColours; ++c)
        result[c] += light.albedo[c] *
                     seen(scene.attenuation[n] * light.shadow[c] * scene.extinctionColour[c], weight[c]);
    }
  }
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
