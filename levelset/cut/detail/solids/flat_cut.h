#pragma once

#include <span>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/cut/detail/solids/carve.h"
#include "nephele/levelset/cut/detail/solids/cut_source.h"

namespace nephele::detail {

/// @throws Error if kerf, least volume, planes, cells or the slopes of fields are out of range.
void requireKnives(const Knives& knives, const CutOptions& options);

/// The pieces that planes and cells, which must be in range, make of the parts of a source; other knives have
/// made the parts.
/// @throws Cancelled.
Pieces piecesOf(const CutSource& source, std::span<const Carved::Part> parts, const Knives& flat,
                const CutOptions& options, const Progress& progress);

}  // namespace nephele::detail
