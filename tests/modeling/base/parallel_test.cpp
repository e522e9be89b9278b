// Loops on all threads: how they stop.
#include "nephele/modeling/base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>

namespace nephele {
namespace {

/// Cancels after so many pieces of work.
struct AfterPieces final : Progress {
  explicit AfterPieces(int after) : limit(after) {}
  bool cancelled() const override { return done >= limit; }

  const int limit;
  mutable std::atomic<int> done{0};
};

constexpr int kLimit = 20, kCount = 100000;

/// Pieces that are under way on other threads when one sees that it is over are finished.
void expectStoppedAtOnce(const AfterPieces& progress) {
  EXPECT_GE(progress.done, kLimit);
  EXPECT_LE(progress.done, kLimit + int(threadCount()));
}

TEST(ParallelFor, StopsWithinAPieceWhenItsProgressCancels) {
  const AfterPieces progress(kLimit);
  EXPECT_THROW(parallelFor(
                   kCount, 1, [&](std::size_t, std::size_t) { ++progress.done; }, progress),
               Cancelled);
  expectStoppedAtOnce(progress);
}

TEST(ParallelFor, StopsWithTheScopeAroundIt) {
  const AfterPieces progress(kLimit);
  const CancelScope scope(&progress);
  EXPECT_THROW(parallelFor(kCount, 1, [&](std::size_t, std::size_t) { ++progress.done; }), Cancelled);
  expectStoppedAtOnce(progress);
}

TEST(ParallelFor, StopsWithTheScopeAroundTheLoopThatItIsIn) {
  const AfterPieces progress(kLimit);
  const CancelScope scope(&progress);
  const auto inner = [&](std::size_t, std::size_t) {
    parallelFor(kCount, 1, [&](std::size_t, std::size_t) { ++progress.done; });
  };
  EXPECT_THROW(parallelFor(64, 1, inner), Cancelled);
  expectStoppedAtOnce(progress);
}

TEST(ParallelFor, IsStoppedByTheInnermostScopeAloneAndNoLongerThanThatLives) {
  const AfterPieces ends(0);
  std::atomic<int> done{0};
  const auto loop = [&] { parallelFor(100, 1, [&](std::size_t, std::size_t) { ++done; }); };
  {
    const CancelScope outer(&ends);
    {
      const CancelScope inner(nullptr);
      loop();
    }
    EXPECT_EQ(done, 100);
    EXPECT_THROW(loop(), Cancelled);
  }
  loop();
  EXPECT_EQ(done, 200);
}

}  // namespace
}  // namespace nephele
