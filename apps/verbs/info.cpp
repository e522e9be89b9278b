#include <fmt/format.h>

#include "apps/app.h"
#include "apps/options/descriptions.h"

namespace nephele::apps {
namespace {

struct InfoOptions {
  std::vector<std::string> files;
  bool selfIntersections = false;
};

std::string text(const Description& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number_float()) return fmt::format("{:g}", value.get<double>());
  if (!value.is_array()) return value.dump();
  std::string list;
  for (const Description& entry : value) list += (list.empty() ? "" : ", ") + text(entry);
  return "(" + list + ")";
}

/// One line per value; what belongs together is indented below its name.
void print(const Run& run, const std::string& indent, const std::string& name, const Description& value) {
  const bool isShort = !value.is_structured() || (value.is_array() && !value.empty() && value[0].is_number());
  if (isShort || value.empty())
    return run.result(fmt::format("{}{}: {}", indent, name, isShort ? text(value) : "none"));
  run.result(fmt::format("{}{}:", indent, name));
  if (value.is_object()) {
    for (const auto& [key, entry] : value.items())
      if (key != "name") print(run, indent + "  ", key, entry);
    return;
  }
  for (const Description& entry : value) {
    if (entry.is_object())
      print(run, indent + "  ", entry.at("name"), entry);
    else
      run.result(indent + "  " + text(entry));
  }
}

void describeFiles(const InfoOptions& options, Run& run) {
  std::vector<std::string> errors;
  run.stats["files"] = nlohmann::json::array();
  for (const std::string& path : options.files) {
    run.begin("describe");
    Description description;
    try {
      description = describeFile(path, {options.selfIntersections, run.memoryLimitBytes});
      print(run, "", path, description);
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {
      description["error"] = error.what();
      errors.emplace_back(error.what());
    }
    description["path"] = path;
    run.stats["files"].push_back(nlohmann::json(description));
  }
  if (!errors.empty()) throw SeveralErrors(std::move(errors));
}

void bindOptions(CLI::App& app, InfoOptions& options) {
  app.add_option("files", options.files, "Meshes, volumes (.vdb, .nvdb), images (.exr, .png, .hdr).")
      ->required()
      ->type_name("FILE");
  app.add_flag("--self-intersections", options.selfIntersections,
               "Count intersecting triangles also where a mesh has more than 500 000 triangles.");
}

}  // namespace

Verb infoVerb() {
  return verbOf("info", "Says what is in meshes, volumes and images, and what is wrong with them.",
                "nephele info examples/hare.obj examples/clownfish.png", bindOptions, describeFiles);
}

}  // namespace nephele::apps
