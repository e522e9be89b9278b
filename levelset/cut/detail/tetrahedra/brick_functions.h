#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "nephele/levelset/cut/detail/tetrahedra/carving.h"
#include "nephele/levelset/cut/detail/tetrahedra/lattice_cells.h"
#include "nephele/modeling/field/field.h"

namespace nephele::detail {

/// Points of which a knife is asked for its values.
using PointLanes = std::array<std::vector<float>, 3>;

/// The level set and the knives that may be 0 in a brick, as whole numbers on its samples: function 0, then
/// one for each knife, or two with a kerf. Keeps its memory; not for several threads at once.
class BrickFunctions {
 public:
  struct Function {
    std::uint32_t id;
    /// None of them 0.
    std::array<std::int32_t, kCellSamples> values;
    /// Where the surface passes through a sample.
    std::array<char, kCellSamples> isVertex;
  };

  explicit BrickFunctions(const Carving& carving) : carving_(carving) {}

  /// Reads and asks for all values of a brick.
  void evaluate(const CarvedBrick& brick);

  std::size_t count() const { return functions_.size(); }
  const Function& operator[](std::size_t f) const { return functions_[f]; }
  const Function& byId(std::uint32_t id) const;
  /// The sample, or 0 if it is nearly that.
  std::int32_t ringValue(std::size_t f, int ring) const { return rings_[f][std::size_t(ring)]; }
  /// Whether all functions but those of the knife whose first is `first` have one sign on the tetrahedra
  /// about an edge.
  bool isFarFromOthers(const VertexKey& edge, std::size_t first) const;
  /// Whether the surface passes through a sample. Edges to a vertex at a sample may begin before the brick.
  static bool isVertexAt(const Function& function, const Vec3i& sample);

  void evaluateKnife(std::uint32_t knife, const PointLanes& points, std::span<float> values);

 private:
  using Ring = std::array<std::int32_t, kRingSamples>;

  void placeSamples(const CarvedBrick& brick);
  std::int32_t round(double offset, double largest, Ring& rounded) const;
  void keepFromZero(std::size_t f, std::int32_t margin);
  bool isAloneAt(std::size_t f, int ring) const;
  bool isSimpleAt(std::size_t f, int ring) const;

  const Carving& carving_;
  std::array<float, kRingSamples> samples_;
  PointLanes points_, slopes_;
  std::vector<Function> functions_;
  std::vector<Ring> rings_;
  std::vector<std::int32_t> margins_;
};

}  // namespace nephele::detail
