#pragma once

#include "nephele/levelset/cut/detail/solids/cut_source.h"
#include "nephele/levelset/cut/detail/solids/knife_sheets.h"
#include "nephele/modeling/base/progress.h"

namespace nephele::detail {

/// The rough walls between the cells of `knives`, in and around a solid, as one sheet: three and more walls
/// meet in lines. Its spacing is that of rough blades, or as fine as 3 million triangles allow.
/// Where the noise is steep, a root mean square of some 3 % of the solid and four octaves, its triangles may
/// cross each other, which `arrange` refuses.
/// @throws Error if the roughness is out of range, or more than four cells meet in one place; Cancelled.
KnifeSheet cellWalls(const Knives& knives, const CutSource& solid, const Progress& progress);

}  // namespace nephele::detail
