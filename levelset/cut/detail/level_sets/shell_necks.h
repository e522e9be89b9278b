#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nephele/levelset/cut/detail/level_sets/cut_shells.h"

namespace nephele::detail {

/// Shells of one code that are connected where the piece is thinner than the grid can show, as the tips of
/// wedges are: groups of `kept`, in the order of their first. Cost: as many pairs of shells as there are in
/// reach of each other. @throws Cancelled.
std::vector<std::vector<std::uint32_t>> joinedByNecks(const ScalarField& shape, const CutPlan& plan,
                                                      const CutShells& shells,
                                                      std::span<const std::uint32_t> kept,
                                                      const Progress& progress);

}  // namespace nephele::detail
