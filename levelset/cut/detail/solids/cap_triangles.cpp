// Triangles of single loops: what a constrained Delaunay triangulation cannot do where rounding makes edges
// cross. Cutting ears off each loop gives triangles that fit its neighbours in every case, some of them
// folded over by as much as the rounding.
#include "nephele/levelset/cut/detail/solids/cap_triangles.h"

#include <algorithm>
#include <limits>

namespace nephele::detail {
namespace {

double doubleArea(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

double squaredLength(const PlanePoint& a, const PlanePoint& b) {
  return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
}

}  // namespace

std::vector<std::array<std::uint32_t, 3>> bestTriangles(std::span<const PlanePoint> points,
                                                        std::span<const std::uint32_t> loop) {
  const std::size_t n = loop.size();
  double turn = 0;
  for (std::size_t i = 1; i + 1 < n; ++i)
    turn += doubleArea(points[loop[0]], points[loop[i]], points[loop[i + 1]]);
  const double sense = turn < 0 ? -1.0 : 1.0;
  // Of the part of the loop from i to j, closed by a diagonal: the worst triangle of the best triangulation,
  // and the point that the diagonal's triangle has.
  std::vector<double> worst(n * n, std::numeric_limits<double>::infinity());
  std::vector<std::size_t> apex(n * n);
  for (std::size_t span = 2; span < n; ++span)
    for (std::size_t i = 0; i + span < n; ++i) {
      const std::size_t j = i + span;
      worst[i * n + j] = -std::numeric_limits<double>::infinity();
      apex[i * n + j] = i + 1;
      for (std::size_t k = i + 1; k < j; ++k) {
        const PlanePoint &a = points[loop[i]], &b = points[loop[k]], &c = points[loop[j]];
        const double longest = std::max({squaredLength(a, b), squaredLength(b, c), squaredLength(c, a)});
        const double shape = longest > 0 ? sense * doubleArea(a, b, c) / longest : 0;
        const double here = std::min({shape, worst[i * n + k], worst[k * n + j]});
        if (here <= worst[i * n + j]) continue;
        worst[i * n + j] = here;
        apex[i * n + j] = k;
      }
    }
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<std::size_t, 2>> open{{0, n - 1}};
  while (!open.empty()) {
    const auto [i, j] = open.back();
    open.pop_back();
    if (j < i + 2) continue;
    const std::size_t k = apex[i * n + j];
    triangles.push_back({loop[i], loop[k], loop[j]});
    open.push_back({i, k});
    open.push_back({k, j});
  }
  return triangles;
}

std::vector<std::array<std::uint32_t, 3>> earTriangles(std::span<const PlanePoint> points,
                                                       std::span<const std::uint32_t> loop) {
  // Above this the first ear that fits is taken, not the best.
  constexpr std::size_t kFew = 32;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> left(loop.begin(), loop.end());
  double turn = 0;
  for (std::size_t i = 1; i + 1 < left.size(); ++i)
    turn += doubleArea(points[left[0]], points[left[i]], points[left[i + 1]]);
  const double sense = turn < 0 ? -1.0 : 1.0;
  std::size_t start = 0;
  while (left.size() > 3) {
    std::size_t best = 0;
    double bestShape = -2;
    const std::size_t n = left.size();
    for (std::size_t step = 0; step < n; ++step) {
      const std::size_t i = (start + step) % n;
      const std::uint32_t ia = left[(i + n - 1) % n], ib = left[i], ic = left[(i + 1) % n];
      const PlanePoint &a = points[ia], &b = points[ib], &c = points[ic];
      const double longest = std::max({squaredLength(a, b), squaredLength(b, c), squaredLength(c, a)});
      const double area = sense * doubleArea(a, b, c);
      double shape = longest > 0 ? area / longest : 0;
      if (shape > 0) {
        for (const std::uint32_t other : left) {
          if (other == ia || other == ib || other == ic) continue;
          const PlanePoint& p = points[other];
          if (sense * doubleArea(a, b, p) >= 0 && sense * doubleArea(b, c, p) >= 0 &&
              sense * doubleArea(c, a, p) >= 0) {
            shape = -1;
            break;
          }
        }
      } else {
        shape = std::max(-1.5, shape - 1);
      }
      if (shape > bestShape) {
        bestShape = shape;
        best = i;
      }
      if (n > kFew && shape > 0) break;
    }
    triangles.push_back({left[(best + n - 1) % n], left[best], left[(best + 1) % n]});
    left.erase(left.begin() + std::ptrdiff_t(best));
    start = best % left.size();
  }
  triangles.push_back({left[0], left[1], left[2]});
  return triangles;
}

}  // namespace nephele::detail
