#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "nephele/modeling/felt/program.h"

namespace nephele::apps {

/// What an expression of a parameter can ask about the shape that it belongs to.
struct ShapeLookUps {
  /// 0 where the shape begins in this direction, 1 where it ends.
  std::function<ScalarField(const Vec3f& direction)> along;
  /// Cosine between the surface's normal and the direction.
  std::function<ScalarField(const Vec3f& direction)> facing;
  /// A grid, 0 to 1.
  std::function<ScalarField(const std::string& path, const std::string& grid)> mask;
  /// A vertex attribute.
  std::function<ScalarField(const std::string& name, bool hasSpheres)> attribute;
  double time = 0;
  int seed = 0;
};

/// All that expressions of parameters may use: the language's own functions, and
///
///     P                       the place
///     height                  0 at the lowest point of the shape, 1 at the highest
///     normal                  the unit normal of the surface at its nearest point
///     time, seed              the frame, and --seed
///     along(direction)        height along another direction; along(direction, false) goes on beyond
///     facing(direction)       cosine between the normal and the direction
///     mask(path, grid)        a grid as 0 to 1
///     attribute(name, how)    a vertex attribute of the mesh, "closest" or blended by "spheres"
class ShapeNames {
 public:
  /// Without look-ups expressions can be checked, not evaluated.
  explicit ShapeNames(ShapeLookUps lookUps = {});

  const felt::Registry& registry() const { return *registry_; }
  const std::vector<felt::Given>& given() const { return given_; }

 private:
  std::unique_ptr<felt::Registry> registry_;
  std::vector<felt::Given> given_;
};

}  // namespace nephele::apps
