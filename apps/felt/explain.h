#pragma once

#include <vector>

#include "apps/app.h"
#include "nephele/modeling/felt/program.h"

namespace nephele::apps {

/// Where the fields of a script are looked at: the first domain, cache or shape among its variables, or the
/// cube from -1 to 1.
Box boxOfInterest(const std::vector<felt::Named>& variables);

/// Prints what a script lets others set, its fields with what they are made of and what a point of them
/// costs, and its caches with their sizes. The same goes into the statistics.
void explain(const felt::Program& program, const std::vector<felt::Named>& variables, Run& run);

}  // namespace nephele::apps
