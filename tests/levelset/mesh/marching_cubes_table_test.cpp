#include "nephele/levelset/mesh/detail/marching_cubes_table.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <random>

#include "nephele/modeling/base/math.h"

namespace nephele {
namespace {

// No triangle of a cell may pass through another one: checked for every pattern at random zeros.
bool segmentHits(const Vec3d& p, const Vec3d& q, const std::array<Vec3d, 3>& t) {
  const Vec3d n = cross(t[1] - t[0], t[2] - t[0]);
  const double a = dot(p - t[0], n);
  const double b = dot(q - t[0], n);
  if (a * b >= 0) return false;
  const Vec3d x = p + (q - p) * (a / (a - b));
  for (int i = 0; i < 3; ++i) {
    if (dot(cross(t[(i + 1) % 3] - t[i], x - t[i]), n) <= 0) return false;
  }
  return true;
}

TEST(MarchingCubesTable, TrianglesOfACellDoNotCross) {
  const auto& table = detail::CellTable::instance();
  std::mt19937 random(7);
  const auto uniform = [&] { return double(random()) / 0x1p32; };
  std::map<unsigned, int> crossings;
  int centres = 0;
  for (unsigned repeat = 0; repeat < 256 * 200; ++repeat) {
    const unsigned signs = repeat % 256;
    std::array<double, 8> values;
    for (int c = 0; c < 8; ++c) values[c] = (signs >> c & 1 ? 1 : -1) * std::exp(8 * uniform());
    unsigned joined = 0;
    for (int f = 0; f < 6; ++f) {
      const auto& q = detail::CellTable::faceCorners(f);
      const double saddle = values[q[0]] * values[q[2]] - values[q[1]] * values[q[3]];
      if (values[q[0]] > 0 ? saddle > 0 : saddle < 0) joined |= 1u << f;
    }
    const auto& pattern = table.pattern(signs, joined);
    const auto corners = table.corners(pattern);
    centres += pattern.hasCentre;
    std::array<Vec3d, 13> points;
    for (int e = 0; e < 12; ++e) {
      const int start = detail::CellTable::edgeStart(e);
      const int axis = detail::CellTable::edgeAxis(e);
      points[e] = {double(start & 1), double(start >> 1 & 1), double(start >> 2)};
      points[e][axis] = values[start] / (values[start] - values[start + (1 << axis)]);
    }
    int fan = 0;
    for (std::size_t i = 0; i < corners.size(); i += 3) {
      if (corners[i + 2] != detail::CellTable::kCentre) continue;
      points[12] += points[corners[i]];
      ++fan;
    }
    if (fan) points[12] = points[12] / double(fan);
    for (std::size_t i = 0; i < corners.size(); i += 3) {
      const std::array<Vec3d, 3> t{points[corners[i]], points[corners[i + 1]], points[corners[i + 2]]};
      for (std::size_t j = 0; j < corners.size(); ++j) {
        const auto p = corners[j];
        const auto q = corners[j - j % 3 + (j + 1) % 3];
        const auto isCorner = [&](int v) {
          return v == corners[i] || v == corners[i + 1] || v == corners[i + 2];
        };
        if (!isCorner(p) && !isCorner(q) && segmentHits(points[p], points[q], t))
          ++crossings[signs << 8 | joined];
      }
    }
  }
  EXPECT_GT(centres, 0);
  for (const auto& [key, count] : crossings) {
    ADD_FAILURE() << "signs " << (key >> 8) << " joined " << (key & 0xff) << " inside corners "
                  << std::popcount(key >> 8) << ": " << count;
  }
}

}  // namespace
}  // namespace nephele
