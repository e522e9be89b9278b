#pragma once

#include <cstddef>
#include <functional>

#include "nephele/modeling/base/progress.h"

namespace nephele {

/// Calls `body(begin, end)` on disjoint pieces that cover [0, count), on all threads that the process may
/// use.
///
/// Pieces hold at most `grain` items. Reports the finished share to `progress` and stops early, by throwing,
/// when it or the CancelScope around the call cancels; an exception thrown by `body` is rethrown here. The
/// pieces' order is not fixed: results must not depend on it. @throws Cancelled
void parallelFor(std::size_t count, std::size_t grain,
                 const std::function<void(std::size_t, std::size_t)>& body,
                 const Progress& progress = silent());

/// While it lives, every parallelFor that its thread begins, and those within, stop when `progress` cancels,
/// whether they are given it or not. The innermost one counts. For the program around long work, which is
/// then left within one piece of a loop.
class CancelScope {
 public:
  /// `progress` must outlive this; null: nothing cancels.
  explicit CancelScope(const Progress* progress);
  ~CancelScope();
  CancelScope(const CancelScope&) = delete;
  CancelScope& operator=(const CancelScope&) = delete;

  /// @throws Cancelled where the innermost one of this thread cancels.
  static void check();

 private:
  const Progress* around_;
};

/// Threads that parallelFor uses at most.
std::size_t threadCount();

}  // namespace nephele
