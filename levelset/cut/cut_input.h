#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "nephele/levelset/cut/cut_parts.h"
#include "nephele/levelset/mesh/mesh_repair.h"

/// What a cut works with, from files.
namespace nephele {

/// The first scalar grid of a file, which must be a level set. @throws Error naming the path.
std::shared_ptr<const BrickGrid> readLevelSet(const std::string& path);

/// A closed mesh to cut by: a mesh file, repaired, which is told as notes, or the marching cubes
/// mesh of a level set.
/// @throws Error naming the path.
Mesh readSolid(const std::string& path, const MeshRepairOptions& repair, const Progress& progress = silent());

/// Points inside the parts, as many in each as fit its volume.
/// @throws Error as `scatteredPoints` of a field does.
std::vector<Vec3f> scatteredPoints(std::span<const CutPart> parts, int count, std::uint32_t seed);

}  // namespace nephele
