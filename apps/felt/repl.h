#pragma once

#include "apps/app.h"
#include "nephele/modeling/felt/context.h"

namespace nephele::apps {

/// Answers what is entered line by line, until the input ends. Where the input is no terminal, ends the
/// program with kUsage if there was a fault.
void answerLines(const felt::Limits& limits, Run& run);

}  // namespace nephele::apps
