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

LookSubject LookSubject::of(const std::string& path) {
  if (path.empty()) return {};
  if (isScript({path})) return {Kind::script, path};
  require(!fileStamp(path).empty(), path + ": there is no such file");
  return {areShapes({path}) ? Kind::shape : Kind::volume, path};
}

}  // namespace nephele::apps
