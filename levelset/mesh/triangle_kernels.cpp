// Point to triangle distance, eight samples of a row at a time.
//
// A point that lies inside the three side planes has its foot on the face; any other has it on the nearest of
// the three sides (or their ends). Both are computed without branches. Rows of samples farther than the band
// from the triangle's box or plane are left out. The operations of both forms are the same in the same order,
// without contraction.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/levelset/mesh/triangle_kernels.cpp"
#include "nephele/levelset/mesh/triangle_kernels.h"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace nephele::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
constexpr int kSide = 8;
constexpr int kSquaresAcross = kSide / 2, kSquares = kSquaresAcross * kSquaresAcross;
constexpr float kHalfRow = 3.5f;
/// Keeps bounds bounds.
constexpr float kRounding = 1.00001f;

void nearest(const TriangleShape* shapes, const PlacedTriangle* placed, std::size_t count, float band,
             NearestSamples& samples) {
  const hn::CappedTag<float, kSide> d;
  const hn::RebindToSigned<decltype(d)> di;
  const int lanes = int(hn::Lanes(d));
  using V = hn::Vec<decltype(d)>;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  // Upper bounds of what the samples of each row have found, and those of each square of 2 x 2 rows.
  float reach[kSide * kSide];
  std::fill_n(reach, kSide * kSide, band);
  alignas(64) float squareReach[kSquares], squareY[kSquares], squareZ[kSquares];
  for (int i = 0; i < kSquares; ++i) {
    squareReach[i] = band;
    squareY[i] = float(2 * (i % kSquaresAcross)) + 0.5f;
    squareZ[i] = float(2 * (i / kSquaresAcross)) + 0.5f;
  }
  const V half = hn::Set(d, 0.5f);
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3f m = placed[k].middle;
    const float mx = std::max(std::abs(m.x - kHalfRow) - kHalfRow, 0.0f), radius = placed[k].radius;
    std::uint32_t near = 0;
    for (int i = 0; i < kSquares; i += lanes) {
      const auto beyond = [&](const float* middles, float at) {
        return hn::Max(hn::Sub(hn::AbsDiff(hn::Load(d, middles + i), hn::Set(d, at)), half), zero);
      };
      const V dy = beyond(squareY, m.y), dz = beyond(squareZ, m.z);
      const V away = hn::Add(hn::Add(hn::Set(d, mx * mx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
      const V most = hn::Add(hn::Load(d, squareReach + i), hn::Set(d, radius));
      // Rounding must not take away what the test of a row would keep.
      const auto mask = hn::Le(away, hn::Mul(hn::Mul(most, most), hn::Set(d, kRounding)));
      std::uint8_t bits[8] = {};
      hn::StoreMaskBits(d, mask, bits);
      near |= std::uint32_t(bits[0]) << i;
    }
    if (near == 0) continue;
    const TriangleShape& s = shapes[placed[k].index];
    const Vec3f a = placed[k].corner;
    const float planeSlack = kHalfRow * std::abs(s.normal.x);
    const auto code = hn::Set(di, std::int32_t(placed[k].index) * 8);
    const float lowY = std::min(0.0f, std::min(s.ab.y, s.ac.y)),
                highY = std::max(0.0f, std::max(s.ab.y, s.ac.y));
    const float lowZ = std::min(0.0f, std::min(s.ab.z, s.ac.z)),
                highZ = std::max(0.0f, std::max(s.ab.z, s.ac.z));
    for (; near != 0; near &= near - 1) {
      const int square = hwy::Num0BitsBelowLS1Bit_Nonzero32(near);
      for (int row = 0; row < 4; ++row) {
        const int y = 2 * (square % kSquaresAcross) + (row & 1),
                  z = 2 * (square / kSquaresAcross) + (row >> 1);
        const float pyScalar = float(y) - a.y, pzScalar = float(z) - a.z;
        const float middle = s.normal.x * (kHalfRow - a.x) + s.normal.y * pyScalar + s.normal.z * pzScalar;
        const float rowReach = reach[z * kSide + y];
        if (std::abs(middle) > rowReach + planeSlack) continue;
        if (std::max(lowY - pyScalar, pyScalar - highY) > rowReach) continue;
        if (std::max(lowZ - pzScalar, pzScalar - highZ) > rowReach) continue;
        const float my = float(y) - m.y, mz = float(z) - m.z, sphereReach = rowReach + radius;
        if (mx * mx + my * my + mz * mz > sphereReach * sphereReach) continue;
        bool changed = false;
        const V py = hn::Set(d, pyScalar), pz = hn::Set(d, pzScalar);
        const auto dotWith = [&](const Vec3f& n, V x, V yy, V zz) {
          return hn::Add(hn::Add(hn::Mul(hn::Set(d, n.x), x), hn::Mul(hn::Set(d, n.y), yy)),
                         hn::Mul(hn::Set(d, n.z), zz));
        };
        for (int x = 0; x < kSide; x += lanes) {
          const V px = hn::Sub(hn::Iota(d, float(x)), hn::Set(d, a.x));
          const V qx = hn::Sub(px, hn::Set(d, s.ab.x)), qy = hn::Sub(py, hn::Set(d, s.ab.y)),
                  qz = hn::Sub(pz, hn::Set(d, s.ab.z));
          const V height = dotWith(s.normal, px, py, pz);
          V best = hn::Mul(height, height);
          float* squared = samples.squared + (z * kSide + y) * kSide + x;
          const V old = hn::Load(d, squared);
          // No point of a triangle is nearer than its plane.
          if (hn::AllTrue(d, hn::Ge(hn::Mul(best, hn::Set(d, kRounding)), old))) continue;
          const auto inside = hn::And(hn::And(hn::Gt(dotWith(s.insideAB, px, py, pz), zero),
                                              hn::Gt(dotWith(s.insideBC, qx, qy, qz), zero)),
                                      hn::Gt(dotWith(s.insideCA, px, py, pz), zero));
          V feature = zero;
          if (!hn::AllTrue(d, inside)) {
            const auto side = [&](const Vec3f& along, float per, V x0, V y0, V z0, float atStart,
                                  float between, float atEnd, V& f) {
              const V t = hn::Mul(dotWith(along, x0, y0, z0), hn::Set(d, per));
              const V u = hn::Min(hn::Max(t, zero), one);
              const V dx = hn::Sub(x0, hn::Mul(u, hn::Set(d, along.x)));
              const V dy = hn::Sub(y0, hn::Mul(u, hn::Set(d, along.y)));
              const V dz = hn::Sub(z0, hn::Mul(u, hn::Set(d, along.z)));
              f = hn::IfThenElse(hn::Le(t, zero), hn::Set(d, atStart),
                                 hn::IfThenElse(hn::Ge(t, one), hn::Set(d, atEnd), hn::Set(d, between)));
              return hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
            };
            V f1, f2, f3;
            const V d1 = side(s.ab, s.perAB, px, py, pz, 4, 1, 5, f1);
            const V d2 = side(s.bc, s.perBC, qx, qy, qz, 5, 2, 6, f2);
            const V d3 = side(s.ac, s.perAC, px, py, pz, 4, 3, 6, f3);
            const auto second = hn::Lt(d2, d1);
            const V d12 = hn::IfThenElse(second, d2, d1), f12 = hn::IfThenElse(second, f2, f1);
            const auto third = hn::Lt(d3, d12);
            best = hn::IfThenElse(inside, best, hn::IfThenElse(third, d3, d12));
            feature = hn::IfThenElse(inside, zero, hn::IfThenElse(third, f3, f12));
          }
          const auto nearer = hn::Lt(best, old);
          if (hn::AllFalse(d, nearer)) continue;
          hn::Store(hn::IfThenElse(nearer, best, old), d, squared);
          changed = true;
          std::int32_t* codes = samples.code + (z * kSide + y) * kSide + x;
          const auto fresh = hn::Add(code, hn::ConvertTo(di, feature));
          hn::Store(hn::IfThenElse(hn::RebindMask(di, nearer), fresh, hn::Load(di, codes)), di, codes);
        }
        if (changed) {
          V farthest = zero;
          for (int x = 0; x < kSide; x += lanes)
            farthest = hn::Max(farthest, hn::Load(d, samples.squared + (z * kSide + y) * kSide + x));
          reach[z * kSide + y] = std::sqrt(hn::GetLane(hn::MaxOfLanes(d, farthest))) * kRounding;
          const float* of = reach + (z & ~1) * kSide + (y & ~1);
          squareReach[square] = std::max(std::max(of[0], of[1]), std::max(of[kSide], of[kSide + 1]));
        }
      }
    }
  }
}

}  // namespace nephele::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nephele::detail {

HWY_EXPORT(nearest);

void nearestTriangles(const TriangleShape* shapes, const PlacedTriangle* placed, std::size_t count,
                      float band, NearestSamples& samples) {
  HWY_DYNAMIC_DISPATCH(nearest)(shapes, placed, count, band, samples);
}

TriangleShape triangleShape(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d ab = b - a, ac = c - a, bc = c - b;
  const Vec3d n = normalize(cross(ab, ac));
  const auto per = [](const Vec3d& side) {
    const double squared = dot(side, side);
    return squared > 0 ? float(1.0 / squared) : 0.0f;
  };
  return {Vec3f(ab),           Vec3f(ac),           Vec3f(bc), Vec3f(n), Vec3f(cross(n, ab)),
          Vec3f(cross(n, bc)), Vec3f(cross(ac, n)), per(ab),   per(ac),  per(bc)};
}

PlacedTriangle placeTriangle(std::uint32_t index, const TriangleShape& shape, const Vec3f& corner) {
  const Vec3f toMiddle = (shape.ab + shape.ac) * (1.0f / 3.0f);
  const Vec3f middle = corner + toMiddle;
  const float radius =
      std::sqrt(std::max({dot(toMiddle, toMiddle), dot(shape.ab - toMiddle, shape.ab - toMiddle),
                          dot(shape.ac - toMiddle, shape.ac - toMiddle)}));
  const Vec3f fromBrick = middle - Vec3f(3.5f, 3.5f, 3.5f);
  return {index, corner, middle, radius * 1.00001f, dot(fromBrick, fromBrick)};
}

namespace {

struct SideFoot {
  float squared;
  std::int32_t feature;
};

SideFoot nearestOnSide(const Vec3f& along, float per, const Vec3f& p, std::int32_t atStart,
                       std::int32_t between, std::int32_t atEnd) {
  const float t = (along.x * p.x + along.y * p.y + along.z * p.z) * per;
  const float u = std::min(std::max(t, 0.0f), 1.0f);
  const Vec3f away = p - along * u;
  return {away.x * away.x + away.y * away.y + away.z * away.z, t <= 0 ? atStart : t >= 1 ? atEnd : between};
}

}  // namespace

void nearestTrianglesScalar(const TriangleShape* shapes, const PlacedTriangle* placed, std::size_t count,
                            float, NearestSamples& samples) {
  for (std::size_t k = 0; k < count; ++k) {
    const TriangleShape& s = shapes[placed[k].index];
    for (int i = 0; i < NearestSamples::kSize; ++i) {
      const Vec3f p = Vec3f(float(i % 8), float(i / 8 % 8), float(i / 64)) - placed[k].corner;
      const Vec3f q = p - s.ab;
      SideFoot foot;
      if (dot(s.insideAB, p) > 0 && dot(s.insideBC, q) > 0 && dot(s.insideCA, p) > 0) {
        const float height = dot(s.normal, p);
        foot = {height * height, 0};
      } else {
        foot = nearestOnSide(s.ab, s.perAB, p, 4, 1, 5);
        const SideFoot bc = nearestOnSide(s.bc, s.perBC, q, 5, 2, 6);
        if (bc.squared < foot.squared) foot = bc;
        const SideFoot ac = nearestOnSide(s.ac, s.perAC, p, 4, 3, 6);
        if (ac.squared < foot.squared) foot = ac;
      }
      if (foot.squared < samples.squared[i]) {
        samples.squared[i] = foot.squared;
        samples.code[i] = std::int32_t(placed[k].index) * 8 + foot.feature;
      }
    }
  }
}

}  // namespace nephele::detail
#endif
