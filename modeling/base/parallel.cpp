#include "nephele/modeling/base/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>

namespace nephele {
namespace {

thread_local const Progress* innermost = nullptr;

}  // namespace

CancelScope::CancelScope(const Progress* progress) : around_(innermost) {
  innermost = progress;
}

CancelScope::~CancelScope() {
  innermost = around_;
}

void CancelScope::check() {
  if (innermost) innermost->check();
}

void parallelFor(std::size_t count, std::size_t grain,
                 const std::function<void(std::size_t, std::size_t)>& body, const Progress& progress) {
  if (count == 0) return;
  const std::size_t pieceSize = grain > 0 ? grain : 1;
  const std::size_t pieces = (count + pieceSize - 1) / pieceSize;
  std::atomic<std::size_t> finished{0};
  const Progress* const around = innermost;
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, pieces, 1),
      [&](const tbb::blocked_range<std::size_t>& range) {
        // The threads that help, too; and a thread that waits may help with somebody else's loop.
        const CancelScope scope(around);
        for (std::size_t piece = range.begin(); piece != range.end(); ++piece) {
          progress.check();
          CancelScope::check();
          const std::size_t begin = piece * pieceSize;
          body(begin, begin + pieceSize < count ? begin + pieceSize : count);
          progress.advance(double(finished.fetch_add(1) + 1) / double(pieces));
        }
      },
      tbb::simple_partitioner{});
}

std::size_t threadCount() {
  return std::min(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism),
                  std::size_t(std::max(tbb::this_task_arena::max_concurrency(), 1)));
}

}  // namespace nephele
