// The verbs of the program in Python: the same options, read by the same parser; objects stand where files
// would.
#include <pybind11/stl.h>

#include <mutex>
#include <utility>

#include "apps/detail/program_run.h"
#include "apps/manual/option_table.h"
#include "apps/options/descriptions.h"
#include "apps/python/values.h"
#include "apps/python/watch.h"
#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/cut/piece_files.h"
#include "nephele/levelset/io/memory_file.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/felt/diagnostic.h"
#include "nephele/render/image/frame_range.h"
#include "nephele/render/session/picture_stages.h"

namespace nephele::python {
namespace {

using pybind11::literals::operator""_a;

/// What one call leaves to the next. For several threads: a call that finds it taken does without.
class Kept {
 public:
  std::shared_ptr<PictureStages> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(stages_, {});
  }
  void put(std::shared_ptr<PictureStages> stages) {
    const std::lock_guard lock(mutex_);
    stages_ = std::move(stages);
  }

 private:
  std::mutex mutex_;
  std::shared_ptr<PictureStages> stages_ = std::make_shared<PictureStages>();
};

/// A run that prints nothing: what it has to say goes to a Watch.
class WatchedRun final : public apps::ProgramRun {
 public:
  WatchedRun(const std::string& verb, const apps::CommonOptions& options, const Watch& watch, Kept* kept)
      : ProgramRun(verb, quietened(options)),
        watch_(watch),
        kept_(kept),
        isVerbose_(options.verbose),
        isQuiet_(options.quiet) {
    if (kept_) pictureStages = kept_->take();
  }
  ~WatchedRun() override {
    if (kept_) kept_->put(std::move(pictureStages));
  }

  void begin(std::string_view stage) const override {
    ProgramRun::begin(stage);
    watch_.begin(stage);
  }
  void advance(double fraction) const override { watch_.advance(fraction); }
  void note(std::string_view message) const override {
    if (!isQuiet_) watch_.note(message);
  }
  void detail(std::string_view message) const override {
    if (isVerbose_) watch_.note(message);
  }
  void result(const std::string& line) const override { watch_.tell(10, line); }
  bool cancelled() const override { return watch_.cancelled(); }

 private:
  static apps::CommonOptions quietened(apps::CommonOptions options) {
    options.quiet = true;
    options.verbose = false;
    return options;
  }

  const Watch& watch_;
  Kept* kept_;
  bool isVerbose_, isQuiet_;
};

py::object toPython(const nlohmann::json& value) {
  return py::module_::import("json").attr("loads")(
      value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

/// Does what the program does for these arguments; returns the statistics. Takes from `kept`, if there is
/// one, and leaves there what the next call may need.
py::object callVerb(const std::string& verb, const std::vector<std::string>& arguments,
                    const py::object& progress, const std::shared_ptr<Kept>& kept) {
  nlohmann::json statistics;
  Watch watch;
  watched(watch, progress, [&] {
    try {
      statistics =
          apps::callVerb(verb, arguments, [&](const std::string& name, const apps::CommonOptions& options) {
            return std::make_unique<WatchedRun>(name, options, watch, kept.get());
          });
    } catch (const CLI::Error& error) {
      throw Error(error.what());
    }
  });
  return toPython(statistics);
}

/// The options of a verb, from the table that --help is made from.
py::dict optionsOf(const std::string& name) {
  for (const apps::Verb& verb : apps::allVerbs()) {
    if (verb.name != name) continue;
    py::list options;
    for (const apps::OptionRow& row : apps::optionTable(verb))
      options.append(py::dict("name"_a = row.name, "type"_a = row.type, "default"_a = row.standard,
                              "help"_a = row.help, "group"_a = row.group, "is_input"_a = row.isInput,
                              "is_flag"_a = row.isFlag, "is_output"_a = row.isOutput,
                              "repeats"_a = row.repeats, "choices"_a = row.choices()));
    return py::dict("summary"_a = verb.summary, "example"_a = verb.example, "options"_a = options);
  }
  throw py::value_error("there is no verb '" + name + "'");
}

py::list verbNames() {
  py::list names;
  for (const apps::Verb& verb : apps::allVerbs()) names.append(verb.name);
  return names;
}

/// An object under a path, or room for one.
using File = std::shared_ptr<MemoryFile>;

File fileOfMesh(const std::string& name, const std::shared_ptr<felt::Shape>& mesh) {
  // Shares the mesh, which lives as long as the file.
  return std::make_shared<MemoryFile>(name, ".ply", std::shared_ptr<const Mesh>(mesh, &mesh->mesh));
}

File fileOfGrids(const std::string& name, const std::vector<std::shared_ptr<PythonGrid>>& grids) {
  std::vector<VdbGrid> held;
  Watch watch;
  watched(watch, py::none(), [&] {
    for (const auto& grid : grids) held.push_back(grid->vdb());
  });
  return std::make_shared<MemoryFile>(name, ".vdb", held);
}

py::dict pieceOf(const std::shared_ptr<const Pieces>& pieces, std::size_t index) {
  const Piece& piece = pieces->pieces[index];
  auto shape = std::make_shared<felt::Shape>();
  shape->mesh = piece.mesh;
  shape->name = piece.name;
  py::dict result(
      "name"_a = piece.name, "code"_a = codeText(piece.code), "volume"_a = piece.mass.volume,
      "area"_a = piece.mass.area,
      "centroid"_a = py::make_tuple(piece.mass.centroid.x, piece.mass.centroid.y, piece.mass.centroid.z),
      "closed"_a = piece.closed, "mesh"_a = shape);
  py::list contacts;
  for (const PieceContact& contact : piece.neighbours)
    contacts.append(py::make_tuple(contact.piece, contact.area));
  result["neighbours"] = contacts;
  return result;
}

/// What a verb has left in a file, or None.
py::object contentOf(const File& file) {
  const std::any& held = file->content();
  if (const auto* mesh = std::any_cast<std::shared_ptr<const Mesh>>(&held)) {
    auto shape = std::make_shared<felt::Shape>();
    shape->mesh = **mesh;
    shape->name = "mesh";
    return py::cast(shape);
  }
  if (const auto* grids = std::any_cast<std::vector<VdbGrid>>(&held)) {
    py::list all;
    for (const VdbGrid& grid : *grids) all.append(std::make_shared<PythonGrid>(grid));
    return all;
  }
  if (const auto* picture = std::any_cast<ExrContent>(&held))
    return py::cast(std::make_shared<ExrContent>(*picture));
  if (const auto* pieces = std::any_cast<std::shared_ptr<const Pieces>>(&held)) {
    py::list all;
    for (std::size_t i = 0; i < (*pieces)->pieces.size(); ++i) all.append(pieceOf(*pieces, i));
    return all;
  }
  return py::none();
}

}  // namespace

void addVerbs(py::module_& module) {
  py::class_<MemoryFile, File>(module, "_File")
      .def_property_readonly("path", &MemoryFile::path)
      .def_property_readonly("content", contentOf);
  module.def("_file_of_mesh", fileOfMesh);
  module.def("_file_of_grids", fileOfGrids);
  module.def("_file_of_picture", [](const std::string& name, const std::shared_ptr<ExrContent>& picture) {
    return std::make_shared<MemoryFile>(name, ".exr", *picture);
  });
  module.def("_room", [](const std::string& name, const std::string& extension) {
    return std::make_shared<MemoryFile>(name, extension);
  });
  module.def("_try_output", [](const std::string& path) { const OutputFile trial(path); });
  py::class_<Kept, std::shared_ptr<Kept>>(module, "_Kept").def(py::init<>());
  module.def("_call_verb", callVerb, "verb"_a, "arguments"_a, "progress"_a,
             "kept"_a = std::shared_ptr<Kept>());
  module.def("_frame_path",
             [](const std::string& pattern, int frame) { return FramePattern::parse(pattern).path(frame); });
  module.def("_options", optionsOf);
  module.def("_verbs", verbNames);
  module.def("_read_mesh", [](const std::string& path) {
    auto shape = std::make_shared<felt::Shape>();
    Watch watch;
    watched(watch, py::none(), [&] { shape->mesh = readMesh(path); });
    shape->name = path;
    return shape;
  });
  module.def("_write_mesh", [](const std::string& path, const std::shared_ptr<felt::Shape>& mesh) {
    Watch watch;
    watched(watch, py::none(), [&] { writeMesh(path, mesh->mesh); });
  });
  module.def("_info", [](const std::string& path) {
    nlohmann::json description;
    Watch watch;
    watched(watch, py::none(), [&] { description = nlohmann::json(apps::describeFile(path)); });
    return toPython(description);
  });
}

}  // namespace nephele::python
