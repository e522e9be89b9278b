#pragma once

#include <vector>

#include "nephele/levelset/cut/detail/tetrahedra/brick_functions.h"

namespace nephele::detail {

/// Moves the vertices of curved blades, which are linear in tetrahedra, onto the blades. Keeps its memory;
/// not for several threads at once.
class BladeVertices {
 public:
  explicit BladeVertices(const Carving& carving) : carving_(carving) {}

  /// Those of the brick's own vertices that are far from other surfaces: in all tetrahedra about their edge
  /// there is one sheet of one blade alone, or the two sides of its kerf. These stay apart, since they keep
  /// their order on all edges and have the same diagonals.
  void move(BrickFunctions& functions, CarvedBrick& brick);

 private:
  /// Where a blade crosses an edge, from 0 at its start to 1 at its end, and what is known of the way there.
  struct Crossing {
    std::size_t vertex;
    Vec3d start, along;
    double offset;
    double low, atLow, high, atHigh, place, linear;
    /// Which end the last step moved: -1, 1, or 0 before the first.
    int moved = 0;
    bool isDone = false;
  };

  void moveOnto(std::size_t undecided, BrickFunctions& functions, CarvedBrick& brick);
  void addCrossing(std::size_t vertex, const BrickFunctions::Function& function, double offset,
                   const CarvedBrick& brick);
  static void closeIn(Crossing& crossing, double residual);

  const Carving& carving_;
  PointLanes points_;
  std::vector<Crossing> crossings_;
  std::vector<float> residuals_;
};

}  // namespace nephele::detail
