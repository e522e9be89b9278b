#include "levelset/point_io.h"

#include "levelset/mesh_io.h"
#include "levelset/mesh_io_private.h"
#include "modeling/error.h"

namespace nephele {

Mesh readPoints(const std::string& path) {
  const std::string content = detail::readWholeFile(path);
  if (!content.starts_with("ply\n") && !content.starts_with("ply\r")) return readMesh(path);
  const detail::MeshFile file{path, content};
  Mesh mesh = detail::readPly(file);
  if (mesh.positions.empty()) file.fail("has no points");
  return mesh;
}

}  // namespace nephele
