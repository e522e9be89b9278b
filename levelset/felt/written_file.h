#pragma once

#include <initializer_list>
#include <string>

#include "nephele/modeling/felt/context.h"

namespace nephele::felt {

/// Says before the work begins what could not be written at its end. `endings` end what is allowed, as
/// ".vdb", in any case.
/// Returns the one of `endings` that the name has.
/// @throws CallError if the name ends otherwise, or the script has read the file; Error if its folder cannot
/// be written to.
std::string requireWritable(const Context& context, const std::string& path,
                            std::initializer_list<const char*> endings);

}  // namespace nephele::felt
