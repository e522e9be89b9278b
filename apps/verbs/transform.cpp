#include <fmt/format.h>

#include <optional>

#include "apps/app.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/moved.h"
#include "nephele/levelset/io/vdb_io.h"

namespace nephele::apps {
namespace {

enum class UpAxis { y, z };
enum class Unit { millimetre, centimetre, metre, inch, foot };
enum class Place { asIs, centre, ground };

struct TransformOptions {
  std::string input, output;
  UpAxis from = UpAxis::y, to = UpAxis::y;
  Unit unit = Unit::metre, newUnit = Unit::metre;
  double scale = 1;
  Vec3f degrees{}, move{};
  Place place = Place::asIs;
};

constexpr double kMetres[] = {0.001, 0.01, 1, 0.0254, 0.3048};

void bindOptions(CLI::App& app, TransformOptions& options) {
  app.add_option("input", options.input, "Mesh, or volume (.vdb, .nvdb) with all of its grids.")
      ->required()
      ->type_name("FILE");
  addOutput(app, "-o,--output", options.output, {".obj", ".ply", ".stl", ".vdb"},
            "What to write: a mesh of a mesh, a .vdb of a volume.")
      ->required();
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
  addVec3(app, "--rotate", options.degrees, "Turns it by degrees about x, then y, then z, about the origin.");
  addChoice(app, "--place", options.place,
            {{"as-is", Place::asIs}, {"centre", Place::centre}, {"ground", Place::ground}},
            "Then moves its middle to the origin, or the middle of its bottom.");
  addVec3(app, "--move", options.move, "Moves it at last, in units of the output.");
}

Similarity turnOf(const TransformOptions& options) {
  Similarity result;
  result.scale = kMetres[int(options.unit)] / kMetres[int(options.newUnit)] * options.scale;
  if (options.from != options.to)
    result = Similarity::rotation({options.from == UpAxis::z ? -90.0 : 90.0, 0, 0}) * result;
  return Similarity::rotation(Vec3d(options.degrees)) * result;
}

// `box` is that of what was turned.
Similarity placed(const Similarity& turn, const Box& box, const TransformOptions& options) {
  Similarity result = turn;
  if (options.place != Place::asIs && !box.isEmpty()) {
    result.shift -= Vec3d(box.center());
    if (options.place == Place::ground) result.shift.y += double(box.center().y - box.min.y);
  }
  result.shift += Vec3d(options.move);
  return result;
}

void moveMesh(const TransformOptions& options, Run& run) {
  const Mesh mesh = readMesh(options.input);
  const Similarity turn = turnOf(options);
  const Mesh result = namingFile(
      options.input, [&] { return moved(mesh, placed(turn, boundingBox(moved(mesh, turn)), options)); });
  run.begin("write");
  writeMesh(options.output, result);
}

void moveVolume(const TransformOptions& options, Run& run) {
  std::vector<VdbGrid> grids = readVdbFile(options.input);
  const Similarity turn = turnOf(options);
  namingFile(options.input, [&] {
    Box box;
    for (const VdbGrid& grid : grids)
      if (options.place != Place::asIs) box = box.including(activeBox(moved(grid, turn)));
    const Similarity to = placed(turn, box, options);
    for (VdbGrid& grid : grids) grid = moved(grid, to);
  });
  run.begin("write");
  writeVdbFile(options.output, grids, run.metadata());
}

void transform(const TransformOptions& options, Run& run) {
  const bool isVolume = isVolumeFile(options.input);
  if (isVolume != isVolumeFile(options.output))
    throw CLI::ValidationError("--output", isVolume ? "a volume becomes a .vdb" : "a mesh becomes a mesh");
  run.begin("read");
  isVolume ? moveVolume(options, run) : moveMesh(options, run);
  run.result(options.output);
}

}  // namespace

Verb transformVerb() {
  return verbOf("transform", "Moves, turns and scales a mesh or a volume; changes its up axis or unit.",
                "nephele transform scan.ply -o scan.obj --up-axis z --unit mm --place ground", bindOptions,
                transform);
}

}  // namespace nephele::apps
