#pragma once

#include <string>

#include "modeling/mesh.h"

namespace nephele {

/// As readMesh, but a file may hold points only: a PLY without faces, as particle caches are exchanged.
/// @throws Error as readMesh; also if there are no points.
Mesh readPoints(const std::string& path);

}  // namespace nephele
