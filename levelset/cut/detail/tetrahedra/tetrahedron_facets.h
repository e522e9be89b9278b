#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "nephele/modeling/base/math.h"

namespace nephele::detail {

/// A linear function on a tetrahedron by its values at the corners, none of them 0 and none beyond
/// +-kLargestValue, and both signs among them. Values are in units of its own.
using CornerValues = std::array<std::int32_t, 4>;
inline constexpr std::int32_t kLargestValue = 1 << 29;

/// Where one, two or three functions are 0 on an edge, a face or in the inside of a tetrahedron.
struct FacetCorner {
  /// The corners of the tetrahedron that span it, a bit each: one more than there are functions.
  std::uint8_t carrier = 0;
  std::uint8_t count = 0;
  /// Ascending.
  std::array<std::uint16_t, 3> functions{};
};

/// A convex part of the surface where one function is 0, on which no other changes sign.
struct Facet {
  std::uint16_t function = 0;
  /// In the order in which they are seen, counter-clockwise, from the side where the function is negative,
  /// if the corners of the tetrahedron are a right-handed system: (b - a) x (c - a) . (d - a) > 0.
  std::vector<FacetCorner> corners;
  /// Per corner what lies along the edge to the next one: kOnFace | corners of the tetrahedron's face, or
  /// the other function that is 0 there.
  std::vector<std::uint16_t> edges;
  /// Per function whether it is positive there; of its own nothing is meant.
  std::vector<char> isPositive;

  static constexpr std::uint16_t kOnFace = 0x8000;
};

/// Finds the facets in which linear functions meet in a tetrahedron. Signs are those of exact arithmetic,
/// and where these are 0, of functions lowered by tiny amounts, the first by far the most; so that no four
/// surfaces meet in a point, and every decision on a face of the tetrahedron follows from the values at its
/// three corners and the order of the functions. Keeps its memory; not for several threads at once.
class TetrahedronFacets {
 public:
  /// Facets of all the functions, by function; valid until the next call. Cost: number of facets x functions.
  std::span<const Facet> of(std::span<const CornerValues> functions);

 private:
  Facet& next();
  void addSurface(std::uint16_t function);
  void split(std::size_t facet, std::uint16_t function);
  bool isPositiveAt(std::uint16_t function, const FacetCorner& corner) const;

  std::span<const CornerValues> functions_;
  std::vector<Facet> facets_;
  std::size_t used_ = 0;
  std::vector<char> signs_;
};

/// Barycentric weights of a facet's corner, for the corners of its carrier in their order; the rest are 0.
std::array<double, 4> weightsOf(const FacetCorner& corner, std::span<const CornerValues> functions);

}  // namespace nephele::detail
