#pragma once

#include <optional>
#include <vector>

#include "apps/options/options.h"
#include "nephele/levelset/cut/cut.h"
#include "nephele/modeling/shape/knives.h"

namespace nephele::apps {

/// --plane: a point and a normal, may be given again.
void addPlanes(CLI::App& app, std::vector<BladePlane>& planes);

/// --min-volume: a volume in world units, or in percent of the whole.
void addVolume(CLI::App& app, std::optional<Length>& target);

}  // namespace nephele::apps
