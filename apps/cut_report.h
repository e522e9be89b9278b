#pragma once

#include "apps/options/cut_options.h"

namespace nephele::apps {

/// What a cut made, into the statistics; what the user should know of it, as notes: parts that were left out,
/// knives that part nothing.
void report(const Pieces& pieces, const CutKnives& knives, Run& run);

/// Whether parts of the model are gone, left out or taken by a kerf, so that a knife may have parted it
/// though only one side is left.
bool areSomeGone(const Pieces& pieces, const CutKnives& knives);

/// Says that a mesh crosses itself in so many pairs of triangles.
void reportCrossings(std::size_t crossings, Run& run);

}  // namespace nephele::apps
