#pragma once

#include <cstddef>

#include "nephele/levelset/cloud/renormalise.h"
#include "nephele/levelset/io/moved.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/adaptive_mesh.h"
#include "nephele/levelset/mesh/mesh_band.h"

namespace nephele::apps {

/// What program and module must agree on: what is another in one of them was built from other sources.
struct OpenVdbLayout {
  char version[48] = "nephele-openvdb " NEPHELE_VERSION;
  std::size_t functions;
  std::size_t sizes[8] = {sizeof(VdbGridInfo),  sizeof(VdbGridLabel),        sizeof(BrickGrid),
                          sizeof(Mesh),         sizeof(detail::BandOptions), sizeof(BakeOptions),
                          sizeof(DistanceBand), sizeof(VoxelGrid<float>)};

  bool operator==(const OpenVdbLayout& other) const = default;
};

/// The functions of the libraries that need OpenVDB, which a module has (module.cpp) that the program loads
/// when one of them is first called (loader.cpp).
///
/// OpenVDB takes longer to load than all else of the program together, as 69 000 symbols are bound at once.
/// All but the program link the libraries as they are.
struct OpenVdbFunctions {
  OpenVdbLayout layout;
  decltype(&nephele::readVdbFile) readVdbFile;
  decltype(&nephele::readVdbHeaders) readVdbHeaders;
  decltype(&nephele::readScalarGrid) readScalarGrid;
  decltype(&nephele::readVectorGrid) readVectorGrid;
  decltype(&nephele::writeVdbFile) writeVdbFile;
  decltype(&nephele::describe) describe;
  decltype(&nephele::valueRange) valueRange;
  decltype(&nephele::listOf) listOf;
  decltype(&nephele::requireWritable) requireWritable;
  decltype(&nephele::labelOf) labelOf;
  decltype(&nephele::metadataOf) metadataOf;
  decltype(&nephele::copyMetadata) copyMetadata;
  decltype(&nephele::contentBox) contentBox;
  decltype(&nephele::vectorComponents) vectorComponents;
  decltype(&nephele::toVectorVoxels) toVectorVoxels;
  VdbValues (*valuesOf)(const VdbGrid&);
  VdbGrid (*moved)(const VdbGrid&, const Similarity&);
  std::shared_ptr<BrickGrid> (*toBricks)(const VdbGrid&, const BrickSink&);
  VdbGrid (*bricksToVdb)(const BrickGrid&, const VdbGridLabel&);
  VdbGrid (*vectorsToVdb)(const VectorGrids&, const VdbGridLabel&);
  VdbGrid (*voxelsToVdb)(VoxelGrid<float>, const VdbGridLabel&);
  VdbGrid (*vectorVoxelsToVdb)(VoxelGrid<Vec3f>, const VdbGridLabel&);
  decltype(&nephele::adaptiveMesh) adaptiveMesh;
  decltype(&nephele::sweptDistance) sweptDistance;
  decltype(&nephele::rebuiltDistance) rebuiltDistance;
  decltype(&nephele::detail::floodedBand) floodedBand;
};

}  // namespace nephele::apps
