#pragma once

#include <string>

#include "apps/app.h"
#include "nephele/modeling/base/mesh.h"

namespace nephele::apps {

/// Which surface of which grid to mesh, as typed.
struct IsosurfaceOptions {
  std::string grid;
  /// Percentages are of the longest side of a level set's surface.
  Length isovalue;
  double adaptivity = 0;
  const CLI::Option* gridOption = nullptr;
  const CLI::Option* isovalueOption = nullptr;
  const CLI::Option* adaptivityOption = nullptr;

  /// The surface of a volume file. @throws Error also where there is none, naming the range of the values.
  Mesh surfaceOf(const std::string& volume, Run& run) const;
  /// Refuses the options where the input `mesh` is none that they could be for.
  void refuseFor(const std::string& mesh) const;
};

/// Declares the options on `app`.
void addIsosurfaceOptions(CLI::App& app, IsosurfaceOptions& options);

}  // namespace nephele::apps
