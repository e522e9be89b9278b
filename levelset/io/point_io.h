#pragma once

#include <string>

#include "nephele/modeling/base/mesh.h"

namespace nephele {

/// As readMesh, but a file may hold points only: a PLY or OBJ without faces, as particle caches are
/// exchanged, or text (.txt, .csv, .xyz): a point a line, its first three numbers, with blanks, commas or
/// semicolons between; further columns are passed over, and so are lines that start with # and a first line
/// of titles.
/// @throws Error as readMesh; also if there are no points.
Mesh readPoints(const std::string& path);

}  // namespace nephele
