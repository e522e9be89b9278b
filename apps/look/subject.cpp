#include "apps/look/subject.h"

#include "apps/file_hashes.h"
#include "apps/options/picture/script_volume.h"
#include "apps/options/picture/shapes_picture.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/modeling/base/error.h"

namespace nephele::apps {

std::string LookSubject::word() const {
  if (kind == Kind::volume) return "volume";
  if (kind == Kind::script) return "script";
  if (path.empty()) return "species";
  return isMeshFile(path) ? "mesh" : "surface";
}

std::string LookSubject::stamp() const {
  return path.empty() ? std::string() : fileStamp(path);
}

LookSettings LookSubject::cloudSettings(const LookSettings& settings) const {
  LookSettings own = settings["cloud"];
  if (path.empty() && !own.contains("species")) own["species"] = "mediocris";
  return own;
}

std::vector<LookShow::What> LookSubject::views() const {
  using What = LookShow::What;
  std::vector<What> views{What::cloud, What::surface};
  if (!hasCloud()) return views;
  if (word() == "mesh") views.push_back(What::checker);
  views.push_back(What::wisps);
  if (!path.empty()) views.push_back(What::pieces);
  if (!reference.empty()) views.push_back(What::transfer);
  return views;
}

LookSubject LookSubject::of(const std::vector<std::string>& paths) {
  if (paths.empty()) return {};
  const std::string& path = paths.back();
  if (paths.size() == 1 && isScript(paths)) return {Kind::script, path};
  for (const std::string& file : paths) {
    require(!fileStamp(file).empty(), file + ": there is no such file");
    require(paths.size() == 1 || isMeshFile(file), file + ": of two files, both must be meshes");
  }
  if (paths.size() > 1) return {Kind::shape, path, paths.front()};
  return {areShapes({path}, {""}) ? Kind::shape : Kind::volume, path};
}

}  // namespace nephele::apps
