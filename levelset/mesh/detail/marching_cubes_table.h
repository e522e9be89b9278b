#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace nephele::detail {

/// Triangles of every way in which a surface can cross a cell, made once from rules.
///
/// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2 & 1); `signs` has bit c set where corner c is
/// inside. Edge 4 a + u + 2 v runs along axis a; u and v are the coordinates of its ends on the axes after a,
/// cyclically. Face 2 a + s is the one where coordinate a equals s. A face whose inside corners are diagonal
/// to each other is ambiguous: they are joined across it or they are separate.
class CellTable {
 public:
  /// Corners of triangles, three by three, counter-clockwise from outside: the points on edges 0 .. 11, and
  /// the centre point `kCentre`, which no pattern has twice.
  struct Pattern {
    std::uint8_t triangleCount = 0;
    bool hasCentre = false;
    std::uint16_t first = 0;
  };
  static constexpr std::uint8_t kCentre = 12;

  static const CellTable& instance();

  /// Bit f is set where face f is ambiguous.
  unsigned ambiguousFaces(unsigned signs) const { return ambiguous_[signs]; }
  /// `joinedFaces`: bit f is set where the inside corners of the ambiguous face f are joined; other bits are
  /// ignored.
  const Pattern& pattern(unsigned signs, unsigned joinedFaces) const;
  std::span<const std::uint8_t> corners(const Pattern& pattern) const {
    return {corners_.data() + pattern.first, std::size_t(3) * pattern.triangleCount};
  }

  /// Of the ambiguous faces those whose inside corners are joined: where the saddle of the bilinear
  /// interpolant is inside. `value(c)` is the sample at corner c less the isovalue; both cells of a face
  /// multiply the same pairs of numbers, so that they agree to the bit.
  template <class Value>
  static unsigned joinedFaces(unsigned signs, unsigned ambiguous, const Value& value) {
    unsigned joined = 0;
    for (unsigned face = 0; face < 6; ++face) {
      if ((ambiguous >> face & 1) == 0) continue;
      const auto& q = faceCorners(int(face));
      const double even = value(q[0]) * value(q[2]), odd = value(q[1]) * value(q[3]);
      const bool evenInside = signs >> q[0] & 1;
      if (evenInside ? even > odd : odd > even) joined |= 1u << face;
    }
    return joined;
  }

  /// The corners of face `face`, counter-clockwise from outside the cell.
  static const std::array<std::uint8_t, 4>& faceCorners(int face);
  static int edgeAxis(int edge) { return edge >> 2; }
  /// The corner where `edge` starts; it ends at the next one along its axis.
  static int edgeStart(int edge);

 private:
  CellTable();

  std::array<std::uint8_t, 256> ambiguous_{};
  std::array<std::uint16_t, 256> firstPattern_{};
  std::vector<Pattern> patterns_;
  std::vector<std::uint8_t> corners_;
};

}  // namespace nephele::detail
