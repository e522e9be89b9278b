#include "apps/look/subject.h"

#include <fmt/format.h>
#include <sys/stat.h>

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

std::string fileStamp(const std::string& path) {
  struct stat status;
  if (stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return "";
  return fmt::format("{}.{:09}.{}.{}", status.st_mtim.tv_sec, status.st_mtim.tv_nsec, status.st_size,
                     status.st_ino);
}

}  // namespace nephele::apps
