#include "apps/options/transform_options.h"

#include <utility>
#include <vector>

namespace nephele::apps {

namespace {

constexpr double kMetres[] = {0.001, 0.01, 1, 0.0254, 0.3048};

}  // namespace

void addTransformOptions(CLI::App& app, TransformOptions& options) {
  app.add_option("input", options.input, "Mesh, or volume (.vdb, .nvdb) with all of its grids.")
      ->required()
      ->type_name("FILE");
  addOutput(app, "-o,--output", options.output, {".obj", ".ply", ".stl", ".vdb"},
            "What to write: a mesh of a mesh, a .vdb of a volume.")
      ->required();
  using UpAxis = TransformOptions::UpAxis;
  using Unit = TransformOptions::Unit;
  using Place = TransformOptions::Place;
  addChoice(app, "--up-axis", options.from, {{"y", UpAxis::y}, {"z", UpAxis::z}}, "What is up in the input.");
  addChoice(app, "--to-up-axis", options.to, {{"y", UpAxis::y}, {"z", UpAxis::z}},
            "What is up in the output. Turns about x.");
  const std::vector<std::pair<std::string, Unit>> units{{"mm", Unit::millimetre},
                                                        {"cm", Unit::centimetre},
                                                        {"m", Unit::metre},
                                                        {"in", Unit::inch},
                                                        {"ft", Unit::foot}};
  addChoice(app, "--unit", options.unit, units, "World unit of the input.");
  addChoice(app, "--to-unit", options.newUnit, units, "World unit of the output.");
  addNumber(app, "--scale", options.scale, 1e-9, 1e9, "Makes it so many times as large, about the origin.");
  addNumbers(
      app, "--rotate", "X,Y,Z", 3, -36000, 36000, [&options](const Vec3d& v) { options.degrees = v; },
      "Turns it by degrees about x, then y, then z, about the origin.")
      ->default_str("0,0,0");
  addChoice(app, "--place", options.place,
            {{"as-is", Place::asIs}, {"centre", Place::centre}, {"ground", Place::ground}},
            "Then moves its middle to the origin, or the middle of its bottom.");
  constexpr double kFarthest = 1e30;
  addNumbers(
      app, "--move", "X,Y,Z", 3, -kFarthest, kFarthest, [&options](const Vec3d& v) { options.move = v; },
      "Moves it at last, in units of the output.")
      ->default_str("0,0,0");
}

Similarity TransformOptions::turn() const {
  Similarity result;
  result.scale = kMetres[int(unit)] / kMetres[int(newUnit)] * scale;
  if (from != to) result = Similarity::rotation({from == UpAxis::z ? -90.0 : 90.0, 0, 0}) * result;
  return Similarity::rotation(degrees) * result;
}

Similarity TransformOptions::shift(const Box& box) const {
  Similarity result;
  if (place != Place::asIs && !box.isEmpty()) {
    result.shift -= Vec3d(box.center());
    const int up = to == UpAxis::z ? 2 : 1;
    if (place == Place::ground) result.shift[up] += double(box.center()[up] - box.min[up]);
  }
  result.shift += move;
  return result;
}

}  // namespace nephele::apps
