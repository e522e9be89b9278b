#pragma once

#include <CGAL/Exact_rational.h>

#include <array>
#include <compare>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "nephele/levelset/mesh/triangle_tree.h"
#include "nephele/modeling/base/math.h"

/// Holds CGAL: for sources of the target nephele_levelset_exact only.
namespace nephele::detail {

/// How a point where surfaces meet comes about, from points and triangles that are given.
struct Meeting {
  enum class Kind : std::uint8_t {
    /// The point a itself.
    vertex,
    /// Edge a-b and triangle c.
    edgeAndFace,
    /// Edges a-b and c-d, in one plane.
    edges,
    /// The planes of the triangles a, b, c.
    faces
  };

  Kind kind = Kind::vertex;
  std::array<std::uint32_t, 4> of{};

  static Meeting vertex(std::uint32_t v);
  static Meeting edgeAndFace(std::uint32_t a, std::uint32_t b, std::uint32_t triangle);
  static Meeting edges(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d);
  static Meeting faces(std::uint32_t a, std::uint32_t b, std::uint32_t c);

  bool operator==(const Meeting&) const = default;
};

struct MeetingHash {
  std::size_t operator()(const Meeting& meeting) const;
};

/// The two coordinates that a triangle is looked at in, so that its projection is as large as can be; 3: the
/// triangle has no area.
using FlatAxis = std::uint8_t;

/// Points by number, each place once, with places that can be compared exactly. Given points come first.
class MeetingPoints {
 public:
  using Rational = CGAL::Exact_rational;
  using ExactPoint = std::array<Rational, 3>;

  /// What is given must outlive this; no two of the positions are equal.
  MeetingPoints(std::span<const Vec3d> positions, std::span<const TriangleIndices> triangles);

  /// The numbers of points; equal places, however they come about, get the same one.
  std::vector<std::uint32_t> add(std::span<const Meeting> meetings);

  std::size_t count() const { return given_.size() + added_.size(); }
  /// Within 1e-14 of the size of everything.
  const Vec3d& position(std::uint32_t point) const {
    return point < given_.size() ? given_[point] : places_[point - given_.size()];
  }
  ExactPoint exactPosition(std::uint32_t point) const;
  /// 1, 0, -1: whether c lies to the left of the line from a to b, on it or to the right, as seen along
  /// `axis`.
  int side(FlatAxis axis, std::uint32_t a, std::uint32_t b, std::uint32_t c) const;
  /// Of points on the line through two others: puts them in the order from the one to the other.
  void sortAlong(std::uint32_t from, std::uint32_t to, std::vector<std::uint32_t>& points) const;
  /// Whether a point on the line through two others lies between them, and is none of them.
  bool isBetween(std::uint32_t from, std::uint32_t to, std::uint32_t point) const;

 private:
  ExactPoint given(std::uint32_t v) const;
  ExactPoint evaluate(const Meeting& meeting) const;
  Vec3d approximate(const Meeting& meeting) const;
  /// An order along every line, the same for all points of one.
  bool isLess(bool isShort, int axis, std::uint32_t a, std::uint32_t b) const;
  std::pair<bool, int> axisOf(std::uint32_t from, std::uint32_t to) const;

  std::span<const Vec3d> given_;
  std::span<const TriangleIndices> triangles_;
  double size_ = 0.0;
  std::vector<Meeting> added_;
  std::vector<Vec3d> places_;
  std::unordered_map<Meeting, std::uint32_t, MeetingHash> numbers_;
  /// Given points that something meets in.
  std::vector<std::uint32_t> touched_;
};

/// The first coordinate of the two that are left without `axis`; the other one follows it.
constexpr int firstCoordinate(FlatAxis axis) {
  return (axis + 1) % 3;
}
constexpr int secondCoordinate(FlatAxis axis) {
  return (axis + 2) % 3;
}

}  // namespace nephele::detail
