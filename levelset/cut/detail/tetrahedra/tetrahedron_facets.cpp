// Linear functions that part a tetrahedron.
//
// The zero surface of a function is a triangle or a quadrilateral; every other function splits what is there
// of it in two. A corner is known by the functions that are 0 at it and by the edge, face or tetrahedron in
// which it lies, so that all questions are signs of determinants of values at corners of the tetrahedron:
// with the weights w of the corner, the sign of sum(w f) is that of det(f; g ...) det(1; g ...), for the
// functions g that are 0 there. Values are whole numbers of 30 bits, so that 128 bits hold every determinant.
//
// Ties are decided as if every function f_i were lowered by e_i, with e_1 much larger than e_2 and so on
// (Edelsbrunner and Muecke, "Simulation of Simplicity", 1990). A determinant is linear in all of these, as
// they add the same row of ones; the first that does not vanish decides.
#include "nephele/levelset/cut/detail/tetrahedra/tetrahedron_facets.h"

#include <algorithm>
#include <bit>

namespace nephele::detail {
namespace {

__extension__ typedef __int128 Wide;

/// Up to four rows of values at the corners of a carrier.
using Rows = std::array<CornerValues, 4>;

Wide determinant2(const CornerValues& a, const CornerValues& b, int i, int j) {
  return Wide(a[std::size_t(i)]) * b[std::size_t(j)] - Wide(a[std::size_t(j)]) * b[std::size_t(i)];
}

Wide determinant3(const CornerValues& a, const CornerValues& b, const CornerValues& c, int i, int j, int k) {
  return a[std::size_t(i)] * determinant2(b, c, j, k) - a[std::size_t(j)] * determinant2(b, c, i, k) +
         a[std::size_t(k)] * determinant2(b, c, i, j);
}

/// Of the first `size` rows and columns.
Wide determinant(const Rows& r, int size) {
  if (size == 2) return determinant2(r[0], r[1], 0, 1);
  if (size == 3) return determinant3(r[0], r[1], r[2], 0, 1, 2);
  return r[0][0] * determinant3(r[1], r[2], r[3], 1, 2, 3) -
         r[0][1] * determinant3(r[1], r[2], r[3], 0, 2, 3) +
         r[0][2] * determinant3(r[1], r[2], r[3], 0, 1, 3) -
         r[0][3] * determinant3(r[1], r[2], r[3], 0, 1, 2);
}

int signOf(Wide x) {
  return x > 0 ? 1 : x < 0 ? -1 : 0;
}

constexpr CornerValues kOnes{1, 1, 1, 1};

/// The values at the corners of a carrier, in their order.
CornerValues carried(const CornerValues& values, std::uint8_t carrier) {
  CornerValues result{};
  std::size_t n = 0;
  for (std::size_t i = 0; i < 4; ++i)
    if (carrier >> i & 1) result[n++] = values[i];
  return result;
}

/// Even orders of the corners of a tetrahedron, with one corner or a pair of corners first.
constexpr std::array<std::array<std::uint8_t, 4>, 16> kOrders = [] {
  std::array<std::array<std::uint8_t, 4>, 16> orders{};
  orders[1] = {0, 1, 2, 3};
  orders[2] = {1, 0, 3, 2};
  orders[4] = {2, 0, 1, 3};
  orders[8] = {3, 0, 2, 1};
  orders[3] = {0, 1, 2, 3};
  orders[5] = {0, 2, 3, 1};
  orders[9] = {0, 3, 1, 2};
  orders[6] = {1, 2, 0, 3};
  orders[10] = {1, 3, 2, 0};
  orders[12] = {2, 3, 0, 1};
  return orders;
}();

void add(FacetCorner& corner, std::uint16_t function) {
  std::size_t at = corner.count++;
  for (; at > 0 && corner.functions[at - 1] > function; --at) corner.functions[at] = corner.functions[at - 1];
  corner.functions[at] = function;
}

/// A point in a tetrahedron at which two functions are 0.
FacetCorner zeroOf(std::uint16_t a, std::uint16_t b) {
  return {15, 2, {std::min(a, b), std::max(a, b), 0}};
}

}  // namespace

std::span<const Facet> TetrahedronFacets::of(std::span<const CornerValues> functions) {
  functions_ = functions;
  used_ = 0;
  for (std::uint16_t f = 0; f < functions.size(); ++f) {
    const std::size_t first = used_;
    addSurface(f);
    for (std::uint16_t g = 0; g < functions.size(); ++g) {
      if (g == f) continue;
      const std::size_t end = used_;
      for (std::size_t i = first; i < end; ++i) split(i, g);
    }
  }
  return {facets_.data(), used_};
}

Facet& TetrahedronFacets::next() {
  if (used_ == facets_.size()) facets_.emplace_back();
  Facet& facet = facets_[used_++];
  facet.corners.clear();
  facet.edges.clear();
  facet.isPositive.assign(functions_.size(), 0);
  return facet;
}

void TetrahedronFacets::addSurface(std::uint16_t function) {
  const CornerValues& values = functions_[function];
  unsigned positive = 0;
  for (unsigned i = 0; i < 4; ++i)
    if (values[i] > 0) positive |= 1u << i;
  Facet& facet = next();
  facet.function = function;
  const auto addCorner = [&](int a, int b) {
    facet.corners.push_back({std::uint8_t(1 << a | 1 << b), 1, {function, 0, 0}});
  };
  if (std::popcount(positive) == 2) {
    const auto& o = kOrders[positive];
    addCorner(o[0], o[2]);
    addCorner(o[0], o[3]);
    addCorner(o[1], o[3]);
    addCorner(o[1], o[2]);
  } else {
    const bool isOne = std::popcount(positive) == 1;
    const auto& o = kOrders[isOne ? positive : ~positive & 15u];
    addCorner(o[0], o[1]);
    addCorner(o[0], isOne ? o[2] : o[3]);
    addCorner(o[0], isOne ? o[3] : o[2]);
  }
  for (std::size_t i = 0; i < facet.corners.size(); ++i) {
    const FacetCorner &a = facet.corners[i], &b = facet.corners[(i + 1) % facet.corners.size()];
    facet.edges.push_back(std::uint16_t(Facet::kOnFace | a.carrier | b.carrier));
  }
}

bool TetrahedronFacets::isPositiveAt(std::uint16_t function, const FacetCorner& corner) const {
  const int size = corner.count + 1;
  Rows rows{};
  rows[0] = carried(functions_[function], corner.carrier);
  for (std::size_t i = 0; i < corner.count; ++i)
    rows[i + 1] = carried(functions_[corner.functions[i]], corner.carrier);
  Rows ones = rows;
  ones[0] = kOnes;
  const int whole = signOf(determinant(ones, size));
  int sign = signOf(determinant(rows, size));
  // The first that decides, in the order of the functions: the one in question stands between the others.
  const auto lower = [&](std::size_t row) {
    Rows lowered = rows;
    lowered[row] = kOnes;
    if (sign == 0) sign = -signOf(determinant(lowered, size));
  };
  for (std::size_t i = 0; sign == 0 && i < corner.count; ++i) {
    if (function < corner.functions[i]) lower(0);
    lower(i + 1);
  }
  lower(0);
  return sign * whole > 0;
}

void TetrahedronFacets::split(std::size_t index, std::uint16_t function) {
  const std::size_t count = facets_[index].corners.size();
  signs_.resize(count);
  std::size_t positive = 0;
  for (std::size_t i = 0; i < count; ++i) {
    signs_[i] = isPositiveAt(function, facets_[index].corners[i]);
    positive += std::size_t(signs_[i]);
  }
  if (positive == 0 || positive == count) {
    facets_[index].isPositive[function] = positive != 0;
    return;
  }
  Facet& above = next();
  Facet& below = facets_[index];
  Facet whole;
  whole.corners.swap(below.corners);
  whole.edges.swap(below.edges);
  above.function = below.function;
  above.isPositive = below.isPositive;
  above.isPositive[function] = 1;
  below.isPositive[function] = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const FacetCorner& corner = whole.corners[i];
    const std::uint16_t edge = whole.edges[i];
    const bool isAbove = signs_[i], isNextAbove = signs_[(i + 1) % count];
    Facet& here = isAbove ? above : below;
    here.corners.push_back(corner);
    here.edges.push_back(edge);
    if (isAbove == isNextAbove) continue;
    FacetCorner cut = zeroOf(below.function, function);
    if (edge & Facet::kOnFace) {
      cut.carrier = std::uint8_t(edge & 15);
    } else {
      add(cut, edge);
    }
    // The side that is left goes on along the cut; the other starts where it ends.
    here.corners.push_back(cut);
    here.edges.push_back(function);
    Facet& other = isAbove ? below : above;
    other.corners.push_back(cut);
    other.edges.push_back(edge);
  }
}

std::array<double, 4> weightsOf(const FacetCorner& corner, std::span<const CornerValues> functions) {
  const std::size_t size = corner.count + std::size_t(1);
  Rows rows{};
  for (std::size_t i = 0; i < corner.count; ++i)
    rows[i] = carried(functions[corner.functions[i]], corner.carrier);
  std::array<Wide, 4> minors{};
  if (size == 2) {
    minors = {rows[0][1], -rows[0][0], 0, 0};
  } else if (size == 3) {
    minors = {determinant2(rows[0], rows[1], 1, 2), -determinant2(rows[0], rows[1], 0, 2),
              determinant2(rows[0], rows[1], 0, 1), 0};
  } else {
    for (int i = 0; i < 4; ++i) {
      const Wide minor =
          determinant3(rows[0], rows[1], rows[2], i == 0 ? 1 : 0, i < 2 ? 2 : 1, i < 3 ? 3 : 2);
      minors[std::size_t(i)] = i % 2 == 0 ? minor : -minor;
    }
  }
  Wide sum = 0;
  for (std::size_t i = 0; i < size; ++i) sum += minors[i];
  std::array<double, 4> weights{};
  for (std::size_t i = 0; i < size; ++i) weights[i] = double(minors[i]) / double(sum);
  return weights;
}

}  // namespace nephele::detail
