#include "apps/options/expression_names.h"

#include "nephele/levelset/felt/grid_functions.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/render/felt/render_functions.h"

namespace nephele::apps {

namespace {

Vec3f unit(const Vec3d& direction) {
  const double length = nephele::length(direction);
  if (!(length > 1e-30 && length < 1e30)) throw Error("the direction must not be 0");
  return felt::toFloat(direction / length);
}

bool isSpheres(const std::string& how) {
  if (how != "closest" && how != "spheres")
    throw felt::CallError(felt::Code::outOfRange, "there is no way '" + how + "' to spread an attribute",
                          "\"closest\" or \"spheres\"");
  return how == "spheres";
}

std::unique_ptr<felt::Registry> allFunctions() {
  auto registry = std::make_unique<felt::Registry>();
  felt::addModelingFunctions(*registry);
  felt::addLevelsetFunctions(*registry);
  felt::addRenderFunctions(*registry);
  return registry;
}

}  // namespace

const felt::Registry& feltFunctions() {
  static const std::unique_ptr<const felt::Registry> functions = allFunctions();
  return *functions;
}

ExpressionNames namesOfPlace(double time, int seed) {
  // Nobody owns what stays until the end of the program.
  return {std::shared_ptr<const felt::Registry>(std::shared_ptr<void>(), &feltFunctions()),
          {{"P", {felt::Kind::vectorField}, identity()},
           {"time", {felt::Kind::number}, time},
           {"seed", {felt::Kind::integer}, std::int64_t(seed)}}};
}

ExpressionNames namesOfShape(const ShapeLookUps& lookUps) {
  ExpressionNames names = namesOfPlace(lookUps.time, lookUps.seed);
  std::shared_ptr<felt::Registry> own = allFunctions();
  felt::Registry& r = *own;
  r.group("the shape");
  r.add("scalarfield along(vector direction, bool clamped = true)",
        "0 where the shape begins in this direction, 1 where it ends, and so beyond, unless it is not "
        "clamped and goes on in proportion.",
        "ramp(along((1,0,0)), [0, 1], [1%, 3%])",
        [along = lookUps.along](const Vec3d& direction, bool clamped) {
          const ScalarField way = along(unit(direction));
          return clamped ? clamp(way, 0, 1) : way;
        });
  r.add("scalarfield facing(vector direction)",
        "Cosine between the surface's normal and the direction: 1 where it faces that way, -1 where it faces "
        "away.",
        "ramp(facing((0,1,0)), [-1, 1], [0, 3%])",
        [facing = lookUps.facing](const Vec3d& direction) { return facing(unit(direction)); });
  r.add("scalarfield mask(string path, string grid = \"\")",
        "A grid of a volume file as 0 to 1; of a level set the inside is 1, with an edge of two voxels.",
        "3% * mask(\"mask.vdb\")",
        [mask = lookUps.mask](const std::string& path, const std::string& grid) { return mask(path, grid); });
  r.add("scalarfield attribute(string name, string how = \"closest\")",
        "A vertex attribute of the mesh: of the closest point of the surface, or blended by \"spheres\".",
        "lerp(1%, 3%, attribute(\"growth\"))",
        [attribute = lookUps.attribute](const std::string& name, const std::string& how) {
          return attribute(name, isSpheres(how));
        });
  const auto normal = [facing = lookUps.facing]() -> felt::Value {
    return normalize(vectorField(facing({1, 0, 0}), facing({0, 1, 0}), facing({0, 0, 1})));
  };
  const auto height = [along = lookUps.along] { return felt::Value(clamp(along({0, 1, 0}), 0, 1)); };
  names.given.push_back({"height", {felt::Kind::scalarField}, {}, height});
  names.given.push_back({"normal", {felt::Kind::vectorField}, {}, normal});
  names.registry = std::move(own);
  return names;
}

felt::Value evaluated(const std::string& option, const std::string& expression, const felt::Type& type,
                      const ExpressionNames& names, double longestSide) {
  felt::Context context;
  context.longestSide = longestSide;
  return felt::ExpressionText(option, expression, type, *names.registry, names.given).evaluate(context);
}

std::vector<std::string> checkedExpression(const std::string& option, const std::string& expression,
                                           const felt::Type& type, const ExpressionNames& names) {
  return felt::ExpressionText(option, expression, type, *names.registry, names.given).strings();
}

}  // namespace nephele::apps
