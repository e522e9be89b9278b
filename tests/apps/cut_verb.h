#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nephele/levelset/io/mesh_io.h"
#include "tests/support/run_program.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {

/// A folder, and the verb cut at work in it.
class CutVerb : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return folder_.file(name); }
  std::string meshFile(const std::string& name, const Mesh& mesh) const {
    writeMesh(file(name), mesh);
    return file(name);
  }
  std::string textFile(const std::string& name, const std::string& text) const {
    std::ofstream(file(name)) << text;
    return file(name);
  }
  std::string ball() const { return meshFile("ball.ply", icosphere(1, 3)); }
  std::string box() const { return meshFile("box.ply", boxMesh({-1, -1, -1}, {1, 1, 1})); }

  /// Cuts into the folder `out`, and expects success.
  ProgramResult cut(const std::string& arguments) const {
    const ProgramResult result = attempt(arguments);
    EXPECT_EQ(result.exitCode, 0) << arguments << "\n" << result.errors;
    return result;
  }
  ProgramResult attempt(const std::string& arguments) const {
    return runProgram("cut -o " + file("out") + " --stats " + file("stats.json") + " " + arguments);
  }
  nlohmann::json stats() const { return nlohmann::json::parse(textOf(file("stats.json"))); }
  /// What statistics or the list say of the pieces.
  std::vector<nlohmann::json> statsOfPieces() const {
    return stats()["pieces"].get<std::vector<nlohmann::json>>();
  }
  std::vector<nlohmann::json> listedPieces() const {
    return list()["pieces"].get<std::vector<nlohmann::json>>();
  }
  nlohmann::json list(const std::string& folder = "out") const {
    return nlohmann::json::parse(textOf(file(folder + "/pieces.json")));
  }
  Mesh piece(const std::string& name) const { return readMesh(file("out/" + name)); }
  std::vector<std::string> namesIn(const std::string& folder) const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(file(folder)))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }
  std::vector<std::string> pieceNames(const std::string& folder = "out") const {
    std::vector<std::string> names;
    const nlohmann::json made = list(folder);
    for (const nlohmann::json& piece : made["pieces"]) names.push_back(piece["name"]);
    return names;
  }

  TemporaryFolder folder_;
};

/// The group of that name; null where there is none.
inline const MeshGroup* groupOf(const Mesh& mesh, const std::string& name) {
  const auto found = std::find_if(mesh.groups.begin(), mesh.groups.end(),
                                  [&](const MeshGroup& group) { return group.name == name; });
  return found == mesh.groups.end() ? nullptr : &*found;
}

}  // namespace nephele::test
