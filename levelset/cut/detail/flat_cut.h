#pragma once

#include <span>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/cut/detail/carve.h"
#include "nephele/levelset/cut/detail/cut_source.h"

namespace nephele::detail {

/// @throws Error if planes, cells, kerf or minVolume of the options are out of range.
void requireFlatKnives(const MeshCutOptions& options);

/// The pieces that planes and cells make of the parts of a source; other knives have made the parts.
/// @throws Cancelled.
MeshPieces piecesOf(const CutSource& source, std::span<const Carved::Part> parts,
                    const MeshCutOptions& options, const Progress& progress);

}  // namespace nephele::detail
