#pragma once

#include <cstddef>
#include <functional>

#include "nephele/modeling/base/progress.h"

namespace nephele {

/// Calls `body(begin, end)` on disjoint pieces that cover [0, count), on all threads that the process may
/// use.
///
/// Pieces hold at most `grain` items. Reports the finished share to `progress` and stops early, by throwing,
/// when it cancels; an exception thrown by `body` is rethrown here. The pieces' order is not fixed: results
/// must not depend on it. @throws Cancelled
void parallelFor(std::size_t count, std::size_t grain,
                 const std::function<void(std::size_t, std::size_t)>& body,
                 const Progress& progress = silent());

/// Threads that parallelFor uses at most.
std::size_t threadCount();

}  // namespace nephele
