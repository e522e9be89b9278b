#pragma once

#include "apps/app.h"
#include "nephele/modeling/base/mesh.h"

namespace nephele::apps {

/// Declares --subdivide, the same for every verb that takes a coarse mesh.
CLI::Option* addSubdivide(CLI::App& app, int& times);

/// The mesh subdivided as --subdivide asks, within the memory limit.
Mesh subdividedAsAsked(Mesh mesh, int times, Run& run);

/// What is done to a mesh, as typed: subdivided, then smoothed, then decimated.
struct MeshProcessing {
  int subdivide = 0, smooth = 0;
  /// 0: not asked for.
  int faces = 0;
  Length maxError;

  /// The mesh after it. `name` is what messages call it.
  /// @throws Error where the mesh cannot be held by a half-edge structure, or cannot have so few faces.
  Mesh processed(Mesh mesh, const std::string& name, Run& run) const;
};

/// Declares the options on `app`.
void addMeshProcessing(CLI::App& app, MeshProcessing& processing);

}  // namespace nephele::apps
