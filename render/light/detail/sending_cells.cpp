// The harmonics of a vector of ways, and sums of moments times these.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/render/light/detail/sending_cells.cpp"
#include "nephele/render/light/detail/sending_cells.h"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using CellLanes = hn::CappedTag<float, detail::CellRows::kVector>;
using CellFloats = hn::Vec<CellLanes>;

struct Ways {
  CellFloats x, y, z;
};

HWY_INLINE CellFloats along(Ways ways) {
  return hn::MulAdd(ways.x, ways.x, hn::MulAdd(ways.y, ways.y, hn::Mul(ways.z, ways.z)));
}

// From a place to cells: along z where these are as good as in it, or too far for a float.
HWY_INLINE Ways waysFrom(const Vec3f& place, Ways cells) {
  const CellLanes d;
  const Ways ways{hn::Sub(cells.x, hn::Set(d, place.x)), hn::Sub(cells.y, hn::Set(d, place.y)),
                  hn::Sub(cells.z, hn::Set(d, place.z))};
  const CellFloats square = along(ways), zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const auto isKnown = hn::And(hn::Gt(square, zero), hn::Lt(square, hn::Set(d, 3e38f)));
  const CellFloats per = hn::Div(one, hn::Sqrt(hn::IfThenElse(isKnown, square, one)));
  return {hn::IfThenElseZero(isKnown, hn::Mul(ways.x, per)),
          hn::IfThenElseZero(isKnown, hn::Mul(ways.y, per)),
          hn::IfThenElse(isKnown, hn::Mul(ways.z, per), one)};
}

// Calls each(moment, value) for all harmonics up to a degree, see detail::harmonics.
template <class Each>
HWY_INLINE void harmonicsOf(Ways ways, int degree, const detail::HarmonicFactors& factors, Each&& each) {
  const CellLanes d;
  CellFloats cosine = hn::Set(d, 1.0f), sine = hn::Zero(d);
  for (int m = 0; m <= degree; ++m) {
    CellFloats before = hn::Zero(d), value = hn::Set(d, factors.diagonal[m]);
    for (int l = m; l <= degree; ++l) {
      const int middle = l * l + l;
      const CellFloats norm = hn::Mul(value, hn::Set(d, factors.norm[middle + m]));
      each(l, middle + m, hn::Mul(norm, cosine));
      if (m > 0) each(l, middle - m, hn::Mul(norm, sine));
      const CellFloats next = hn::MulSub(hn::Mul(ways.z, hn::Set(d, factors.ofLast[middle + m])), value,
                                         hn::Mul(before, hn::Set(d, factors.ofBefore[middle + m])));
      before = value;
      value = next;
    }
    const CellFloats turned = hn::MulSub(cosine, ways.x, hn::Mul(sine, ways.y));
    sine = hn::MulAdd(cosine, ways.y, hn::Mul(sine, ways.x));
    cosine = turned;
  }
}

void sendOf(detail::SendingCells& cells) {
  const CellLanes d;
  const detail::HarmonicFactors& factors = detail::harmonicFactors();
  for (int x = 0; x < detail::CellRows::kVector; x += int(hn::Lanes(d))) {
    const Ways places{hn::Add(hn::Set(d, cells.node.x), hn::Iota(d, float(x))), hn::Set(d, cells.node.y),
                      hn::Set(d, cells.node.z)};
    Ways ways{hn::Set(d, cells.eye.x), hn::Set(d, cells.eye.y), hn::Set(d, cells.eye.z)};
    if (cells.isEyeAPlace) ways = waysFrom(cells.eye, places);
    ways = {hn::Neg(ways.x), hn::Neg(ways.y), hn::Neg(ways.z)};
    CellFloats ofBeam[detail::kMostMoments];
    if (cells.beamPlace)
      harmonicsOf(waysFrom(*cells.beamPlace, places), cells.degree, factors,
                  [&](int, int m, CellFloats value) HWY_ATTR { ofBeam[m] = value; });
    CellFloats light = hn::Zero(d), beam = hn::Zero(d);
    harmonicsOf(ways, cells.degree, factors, [&](int l, int m, CellFloats value) HWY_ATTR {
      const CellFloats weighed = hn::Mul(value, hn::Set(d, cells.weights[l]));
      light = hn::MulAdd(weighed, hn::LoadU(d, cells.moments + m * detail::CellRows::kVector + x), light);
      beam = hn::MulAdd(weighed, cells.beamPlace ? ofBeam[m] : hn::Set(d, cells.beamWay[m]), beam);
    });
    const CellFloats sent = hn::Mul(beam, hn::LoadU(d, cells.beam + x)), own = hn::Sub(light, sent);
    hn::Store(own, d, cells.own + x);
    hn::Store(sent, d, cells.ofBeam + x);
  }
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace nephele {
HWY_EXPORT(sendOf);

void detail::send(SendingCells& cells) {
  HWY_DYNAMIC_DISPATCH(sendOf)(cells);
}

}  // namespace nephele

#endif  // HWY_ONCE
