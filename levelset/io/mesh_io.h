#pragma once

#include <string>

#include "nephele/modeling/base/mesh.h"

namespace nephele {

/// Reads OBJ, PLY (ASCII, both binaries), STL (both), OFF, glTF and GLB, by extension and content.
///
/// Soup first: every face of the file is there, polygons stay polygons, texture coordinates become the corner
/// attribute "uv" (width 2), vertex colours "color", other PLY vertex properties their own name, OBJ groups
/// `groups`.
/// @throws Error in one line that names the file and what is wrong, with the line where the format has lines:
/// missing or empty files, truncation, bad indices, non-finite coordinates, no faces, counts the file cannot
/// hold.
Mesh readMesh(const std::string& path);

/// Whether the extension is one of those that `readMesh` reads, in any case.
bool isMeshFile(const std::string& path);

/// Writes .obj, .ply (binary little-endian) or .stl (binary, no attributes) by extension, whole or not at
/// all.
/// @throws Error naming the path; also for an unknown extension, coordinates that are not finite (.stl: as
/// floats), faces of fewer than three corners (not .stl, which has none of them), and colours or texture
/// coordinates that are not finite (.obj; a .ply holds them).
void writeMesh(const std::string& path, const Mesh& mesh);

}  // namespace nephele
