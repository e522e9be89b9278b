#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace nephele {

/// The one of `names` that is nearest to `name` by its spelling, for "did you mean"; or empty if none is
/// near: a third of its letters may differ, and one in any case. Letters may be in other places or missing;
/// whether they are capital does not count. Cost: the product of the lengths, for every name; names of more
/// than 64 bytes are not looked at.
std::string nearestName(std::string_view name, const std::vector<std::string>& names);

}  // namespace nephele
