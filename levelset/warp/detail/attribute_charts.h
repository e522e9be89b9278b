#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "nephele/modeling/base/mesh.h"

/// How the values of corners hang together over a surface. Not for other folders.
namespace nephele::detail {

/// The charts of one corner attribute of a triangle mesh.
///
/// Two triangles that share an edge (positions are compared, not indices) hang together if the values at both
/// of its ends agree; a chart is what hangs together. All other edges are seams.
///
/// For attributes of two numbers, texture coordinates, two more rules hold. A seam with one chart on both
/// sides, whose values differ by the same whole numbers at both ends, wraps: textures repeat, so the triangle
/// beyond it goes on, offset by these numbers. And a vertex whose corners agree in one number and have three
/// or more different others is a pole, as those of a map of the globe: edges that end there need to agree at
/// the other end only.
class AttributeCharts {
 public:
  /// `triangles` has triangles only, `attribute` one item per corner. Values within 1e-5 of their largest
  /// difference agree.
  AttributeCharts(const Mesh& triangles, const MeshAttribute& attribute);

  struct Offset {
    int u = 0, v = 0;
    bool operator==(const Offset&) const = default;
  };
  /// What lies beyond an edge.
  struct Step {
    std::uint32_t triangle;
    /// Added to the values there, so that they agree with those here.
    Offset offset;
  };
  /// Beyond the edge from corner `edge` of the triangle to the next one; nothing at seams and rims.
  std::optional<Step> across(std::uint32_t triangle, int edge) const;

  /// Charts are numbered from 0 in the order of their first triangles.
  std::uint32_t chart(std::uint32_t triangle) const { return chart_[triangle]; }
  std::size_t chartCount() const { return chartCount_; }

  /// Edges that are seams or wrap, as pairs of positions: what a triangle must be kept from crossing unseen.
  const std::vector<std::uint32_t>& seams() const { return seams_; }

  /// The number that means nothing at this corner, which is on a pole; -1 elsewhere.
  int poleComponent(std::size_t corner) const { return poles_.empty() ? -1 : poles_[corner]; }
  /// The least whole number by which the component repeats; 0 where it does not.
  int period(int component) const { return period_[component]; }

  /// Whether values are carried from the same places as those of `other`.
  bool hangsTogetherAs(const AttributeCharts& other) const;

 private:
  void findPoles(const Mesh& mesh, const MeshAttribute& attribute, const std::vector<std::uint32_t>& vertex);

  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  float tolerance_ = 0;
  /// Per triangle and edge.
  std::vector<std::uint32_t> beyond_;
  /// Of edges that wrap, else empty.
  std::vector<Offset> offsets_;
  std::vector<std::uint32_t> chart_;
  std::size_t chartCount_ = 0;
  std::vector<std::uint32_t> seams_;
  std::vector<std::int8_t> poles_;
  int period_[2] = {0, 0};
};

}  // namespace nephele::detail
