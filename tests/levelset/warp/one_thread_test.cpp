#include "nephele/levelset/warp/detail/one_thread.h"

#include <gtest/gtest.h>

#include <future>
#include <thread>

namespace nephele {
namespace {

int activeLevels() {
  return omp_get_max_active_levels ? omp_get_max_active_levels() : -1;
}

TEST(OneThread, HoldsForTheThreadThatMakesItAndWhileItLives) {
  const int before = activeLevels();
  if (before < 0) GTEST_SKIP() << "CHOLMOD is linked without OpenMP";
  {
    const detail::OneThread oneThread;
    EXPECT_EQ(activeLevels(), 0);
    {
      const detail::OneThread nested;
      EXPECT_EQ(activeLevels(), 0);
    }
    EXPECT_EQ(activeLevels(), 0);
  }
  EXPECT_EQ(activeLevels(), before);
}

TEST(OneThread, LeavesOtherThreadsAlone) {
  const int before = activeLevels();
  if (before < 0) GTEST_SKIP() << "CHOLMOD is linked without OpenMP";
  std::promise<void> isHeld, isSeen;
  std::thread other([&] {
    const detail::OneThread oneThread;
    isHeld.set_value();
    isSeen.get_future().wait();
  });
  isHeld.get_future().wait();
  EXPECT_EQ(activeLevels(), before);
  int inThird = -1;
  std::thread([&] { inThird = activeLevels(); }).join();
  EXPECT_EQ(inThird, before);
  isSeen.set_value();
  other.join();
}

}  // namespace
}  // namespace nephele
