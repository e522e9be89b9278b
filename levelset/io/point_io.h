#pragma once

#include <string>

#include "nephele/modeling/base/mesh.h"

namespace nephele {

/// As readMesh, but a file may hold points only: a PLY or OBJ without faces, as particle caches are
/// exchanged, or text (.txt, .csv, .xyz): a point a line, with blanks, commas or semicolons between its
/// columns. A first line of titles says which of them are x, y and z (`x`, `P.x`, `pos_x` or `Points:0`);
/// without such titles the first three are. With them, other columns of numbers are attributes of the points
/// by their titles (`pscale`, `v.x` as `vx`), and three of a colour (`red`, `Cd.r`) are `color`. Lines that
/// start with # are passed over.
/// @throws Error as readMesh; also if there are no points.
Mesh readPoints(const std::string& path);

}  // namespace nephele
