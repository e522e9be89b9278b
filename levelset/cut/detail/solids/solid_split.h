#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "nephele/levelset/mesh/triangle_tree.h"
#include "nephele/modeling/base/math.h"

namespace nephele::detail {

/// normal . x = offset, |normal| = 1.
struct CutPlane {
  Vec3d normal{};
  double offset = 0.0;
  /// Of a bisector, the cells on its sides, lower first; its positive side is the second one's.
  /// Equal: not a bisector.
  std::array<std::uint32_t, 2> cells{};

  double distance(const Vec3d& p) const { return dot(normal, p) - offset; }
};

/// The plane between two cells, low < high.
CutPlane bisector(std::span<const Vec3d> cells, std::uint32_t low, std::uint32_t high);

/// Face identifiers: a triangle of the source, or kOnPlane | a plane. Edges of a source triangle that were
/// there before name kSourceEdge | 0, 1, 2 as what lies beyond.
inline constexpr std::uint32_t kOnPlane = 0x80000000u;
inline constexpr std::uint32_t kSourceEdge = 0x40000000u;

/// A directed edge of a face: the face is on its left, seen from outside. `beyond` is the other surface whose
/// intersection with the face holds the edge.
struct SolidEdge {
  std::uint32_t from = 0, to = 0, beyond = 0;
};

/// A flat face by its edges, as a set: loops, holes and islands in no order.
struct SolidFace {
  std::uint32_t id = 0, firstEdge = 0, edgeCount = 0;
};

/// A closed polyhedron.
struct Solid {
  /// Triangles of the source that no plane has cut.
  std::vector<std::uint32_t> whole;
  std::vector<SolidFace> faces;
  std::vector<SolidEdge> edges;
  Vec3d low{}, high{};

  bool isEmpty() const { return whole.empty() && faces.empty(); }
  std::span<const SolidEdge> edgesOf(const SolidFace& face) const {
    return {edges.data() + face.firstEdge, face.edgeCount};
  }
};

/// Splits solids, all parts of one source, by planes. Not for several threads at once.
class SolidSplitter {
 public:
  /// The source must outlive this. `cells`: points of the Voronoi cells; empty: planes are just planes.
  SolidSplitter(std::span<const Vec3d> positions, std::span<const TriangleIndices> triangles,
                std::span<const Vec3d> cells, double tolerance);

  /// The solid between triangles of the source.
  Solid solidOf(std::span<const std::uint32_t> triangles) const;
  const Vec3d& position(std::uint32_t v) const {
    return v < source_.size() ? source_[v] : added_[v - source_.size()];
  }
  /// Cut points are numbered from here on.
  std::uint32_t firstCutPoint() const { return std::uint32_t(source_.size()); }
  void move(std::uint32_t v, const Vec3d& p) { added_[v - source_.size()] = p; }
  const TriangleIndices& triangle(std::uint32_t t) const { return triangles_[t]; }
  const std::vector<CutPlane>& planes() const { return planes_; }

  /// All splits until the next call are by this plane and share their cut points.
  void begin(const CutPlane& plane);
  /// What of `solid` is on the negative and on the positive side. Sides that are not `wanted` stay empty.
  std::array<Solid, 2> split(const Solid& solid, std::array<bool, 2> wanted = {true, true});
  /// Frees what only splitting needs, and the cut points that are in none of `solids`, which are all that is
  /// left. No `begin` or `split` after this.
  void finish(std::span<Solid* const> solids);
  /// -1, 0, 1: on which side of the plane all of the solid's box lies; 0 also if it is cut.
  int sideOfBox(const Solid& solid, const CutPlane& plane) const;

 private:
  struct LineEnd {
    std::uint32_t vertex;
    int balance;
  };
  struct Side {
    Solid* solid = nullptr;
    /// Edges of kept faces in the plane; `beyond` is the face.
    std::vector<SolidEdge> rim;
    /// Of the face that is being cut.
    std::vector<SolidEdge> part;
  };

  int signOf(std::uint32_t v);
  bool isOnPlane(std::uint32_t v) const { return sign_[v] == 0; }
  std::uint32_t cutVertex(const SolidEdge& edge, std::uint32_t face);
  Vec3d cutPoint(const SolidEdge& edge, std::uint32_t face) const;
  CutPlane surfaceOf(std::uint32_t face) const;
  void cutFace(std::uint32_t id, std::span<const SolidEdge> edges);
  void closeAlongLine();
  void keepWhole(std::uint32_t t, const std::array<int, 3>& signs);
  void keepFace(const Solid& solid, const SolidFace& face);
  int coplanarSide(std::span<const SolidEdge> edges) const;
  void addPart(int side, std::uint32_t id);
  void addCap(int side);
  void measure(Solid& solid) const;

  std::span<const Vec3d> source_;
  std::span<const TriangleIndices> triangles_;
  std::span<const Vec3d> cells_;
  double tolerance_;
  std::vector<Vec3d> added_;
  std::vector<CutPlane> planes_;
  std::vector<std::uint32_t> stamp_;
  std::vector<std::int8_t> sign_;
  std::unordered_map<std::uint64_t, std::uint32_t> cuts_;
  std::array<Side, 2> sides_;
  std::vector<LineEnd> line_;
};

}  // namespace nephele::detail
