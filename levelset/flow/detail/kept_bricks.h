#pragma once

#include "nephele/levelset/flow/flow_map.h"
#include "nephele/levelset/grid/brick_table.h"

namespace nephele::detail {

/// Where the bricks of a map stand. Faces count as outside, as wide as rounding may take a point across them:
/// a grid that is asked there may answer with its background.
class KeptBricks {
 public:
  explicit KeptBricks(const FlowMap& map);

  /// That the map is known at a point (world) whatever way it is rounded.
  bool hold(const Vec3f& world) const;
  /// Moves a point (world) that they do not hold to the nearest one that they do, up to two bricks away;
  /// false if there is none.
  bool moveInside(Vec3f& world) const;

 private:
  /// How far rounding takes index coordinates on their way to the world and back, with room.
  float roundingAt(const Vec3f& q) const;

  Lattice lattice_;
  BrickTable table_{"advection"};
};

}  // namespace nephele::detail
