#pragma once

#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/field/field.h"

namespace nephele::felt {

/// A box around all places where `level` is above 0, found by ranges alone: to a few percent where those are
/// tight, larger where they are not.
/// @throws CallError if there is nothing above 0, or no end of it; Cancelled.
Box extentOf(const ScalarField& level, const Progress& progress = silent());

}  // namespace nephele::felt
