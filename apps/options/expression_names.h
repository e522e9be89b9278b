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

/// All functions that scripts may call.
const felt::Registry& feltFunctions();

/// What an expression may use: functions, and names with their values.
struct ExpressionNames {
  std::shared_ptr<const felt::Registry> registry;
  std::vector<felt::Given> given;
};

/// The language's own functions, and
///
///     P                       the place
///     time, seed              the frame, and --seed
ExpressionNames namesOfPlace(double time, int seed);

/// The same, and
///
///     height                  0 at the lowest point of the shape, 1 at the highest
///     normal                  the unit normal of the surface at its nearest point
///     along(direction)        height along another direction; along(direction, false) goes on beyond
///     facing(direction)       cosine between the normal and the direction
///     mask(path, grid)        a grid as 0 to 1
///     attribute(name, how)    a vertex attribute of the mesh, "closest" or blended by "spheres"
///
/// Without look-ups expressions can be checked, not evaluated.
ExpressionNames namesOfShape(const ShapeLookUps& lookUps = {});

/// The value of the expression that was given to `option`, converted to `type`; `2.5%` and `6x` refer to
/// `longestSide`. @throws felt::ScriptError
felt::Value evaluated(const std::string& option, const std::string& expression, const felt::Type& type,
                      const ExpressionNames& names, double longestSide);

/// Only looks for faults, and returns the strings in it, such as files. @throws felt::ScriptError
std::vector<std::string> checkedExpression(const std::string& option, const std::string& expression,
                                           const felt::Type& type, const ExpressionNames& names);

}  // namespace nephele::apps
