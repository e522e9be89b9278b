#include "nephele/modeling/base/system.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <new>

namespace nephele {
namespace {

constexpr std::size_t kBytes = std::size_t(16) << 20;

TEST(System, PagesAreZeroAndAgainAfterTheyWereDropped) {
  auto* const pages = static_cast<char*>(detail::newPages(kBytes));
  const auto isZero = [](char c) { return c == 0; };
  EXPECT_TRUE(std::all_of(pages, pages + kBytes, isZero));
  detail::adviseHugePages(pages, pages + kBytes);
  std::memset(pages, 7, kBytes);
  // Only whole pages in between are dropped: what stands around them stays.
  detail::dropPages(pages + 1, pages + kBytes - 1);
  EXPECT_EQ(pages[0], 7);
  EXPECT_EQ(pages[kBytes - 1], 7);
  EXPECT_EQ(pages[kBytes / 2], 0);
  detail::freePages(pages, kBytes);
}

TEST(System, PagesThatCannotBeHadAreRefused) {
  EXPECT_THROW(detail::newPages(std::numeric_limits<std::size_t>::max() / 2), std::bad_alloc);
}

TEST(System, PeakOfMemoryGrowsWithWhatIsTouched) {
  const double before = peakMemory();
  EXPECT_GT(before, 1e6);
  auto* const pages = static_cast<char*>(detail::newPages(8 * kBytes));
  std::memset(pages, 1, 8 * kBytes);
  EXPECT_GE(peakMemory(), 8.0 * double(kBytes));
  detail::freePages(pages, 8 * kBytes);
  EXPECT_LT(peakMemory(), allowedMemory());
}

}  // namespace
}  // namespace nephele
