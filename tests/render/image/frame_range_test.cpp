#include "nephele/render/image/frame_range.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

using Frames = std::vector<int>;

std::string refusal(const std::string& text) {
  try {
    FrameRange::parse(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(FrameRange, ReadsSingleFramesRangesAndSteps) {
  EXPECT_EQ(FrameRange::parse("7").frames(), (Frames{7}));
  EXPECT_EQ(FrameRange::parse("1-4").frames(), (Frames{1, 2, 3, 4}));
  EXPECT_EQ(FrameRange::parse("0-0").frames(), (Frames{0}));
  EXPECT_EQ(FrameRange::parse("1001-1009x4").frames(), (Frames{1001, 1005, 1009}));
  EXPECT_EQ(FrameRange::parse("1-48x5").frames().back(), 46);
  EXPECT_EQ(FrameRange::parse("0003-0005").frames(), (Frames{3, 4, 5}));
  // The example of the command line's contract: 50 odd frames and one more.
  const FrameRange range = FrameRange::parse("1001-1100x2,1150");
  EXPECT_EQ(range.frames().size(), 51u);
  EXPECT_EQ(range.first(), 1001);
  EXPECT_EQ(range.last(), 1150);
}

TEST(FrameRange, KeepsTheEndsAsTyped) {
  const FrameRange range = FrameRange::parse("1-48x5");
  EXPECT_EQ(range.first(), 1);
  EXPECT_EQ(range.last(), 48);
}

TEST(FrameRange, PutsFramesInOrderAndEachOnce) {
  EXPECT_EQ(FrameRange::parse("5-7, 1-3,6-8,2").frames(), (Frames{1, 2, 3, 5, 6, 7, 8}));
  EXPECT_TRUE(FrameRange::parse("1-9x2").contains(5));
  EXPECT_FALSE(FrameRange::parse("1-9x2").contains(6));
}

TEST(FrameRange, RefusesWhatItCannotReadAndSaysWhichPart) {
  for (const char* text : {"", ",", "1,", "a", "1-", "-1", "-5-3", "1--3", "1-3x", "1-3x-1", "1..3", "1-3y2",
                           "1x2", "1.5", "1-3x1.5", "#", "0x10"})
    EXPECT_NE(refusal(text).find("is not a range of frames"), std::string::npos) << text;
  EXPECT_NE(refusal("1,3-x").find("'3-x'"), std::string::npos) << refusal("1,3-x");
  EXPECT_NE(refusal("9-1").find("backwards"), std::string::npos);
  EXPECT_NE(refusal("1-9x0").find("step of 0"), std::string::npos);
}

TEST(FrameRange, RefusesHugeNumbersAndHugeRanges) {
  EXPECT_NE(refusal("99999999999999999999").find("largest"), std::string::npos);
  EXPECT_NE(refusal("100000000").find("largest"), std::string::npos);
  EXPECT_EQ(refusal("99999999"), "");
  // Of any length, and told shortly.
  EXPECT_NE(refusal(std::string(1000000, '7')).find("largest"), std::string::npos);
  EXPECT_LT(refusal(std::string(1000000, 'a')).size(), 300u);
  EXPECT_NE(refusal("1-1000001").find("more than 1000000"), std::string::npos);
  EXPECT_NE(refusal("1-600000,600001-1200000").find("more than 1000000"), std::string::npos);
  EXPECT_EQ(FrameRange::parse("0-99999999x1000").frames().size(), 100000u);
}

TEST(FrameRange, SharesPartitionTheFrames) {
  const FrameRange range = FrameRange::parse("1-10,20");
  for (const int count : {1, 2, 3, 5, 11, 12}) {
    Frames all;
    std::size_t least = 100, most = 0;
    for (int index = 1; index <= count; ++index) {
      const Frames shard = range.shard(index, count);
      least = std::min(least, shard.size());
      most = std::max(most, shard.size());
      all.insert(all.end(), shard.begin(), shard.end());
    }
    std::sort(all.begin(), all.end());
    EXPECT_EQ(all, range.frames()) << count;
    EXPECT_LE(most - least, 1u) << count;
  }
  EXPECT_EQ(range.shard(2, 4), (Frames{2, 6, 10}));
  EXPECT_TRUE(range.shard(12, 12).empty());
  EXPECT_THROW(range.shard(0, 2), Error);
  EXPECT_THROW(range.shard(3, 2), Error);
}

TEST(FramePattern, PutsWordsBeforeTheNumber) {
  const auto named = [](const char* text) { return FramePattern::parse(text).withWords("fov_20"); };
  EXPECT_EQ(named("a.####.exr"), "a.fov_20.####.exr");
  EXPECT_EQ(named("b.c/a_%04d.exr"), "b.c/a.fov_20_%04d.exr");
  EXPECT_EQ(named("a$F4.exr"), "a.fov_20.$F4.exr");
  EXPECT_EQ(named("_/####.exr"), "_/fov_20.####.exr");
  EXPECT_EQ(named("b/-#.exr"), "b/fov_20-#.exr");
}

TEST(FramePattern, PutsTheNumberInItsPlace) {
  EXPECT_EQ(FramePattern::parse("a.####.exr").path(7), "a.0007.exr");
  EXPECT_EQ(FramePattern::parse("a.%04d.exr").path(7), "a.0007.exr");
  EXPECT_EQ(FramePattern::parse("a.$F4.exr").path(7), "a.0007.exr");
  EXPECT_EQ(FramePattern::parse("a.#.exr").path(7), "a.7.exr");
  EXPECT_EQ(FramePattern::parse("a%d.exr").path(7), "a7.exr");
  EXPECT_EQ(FramePattern::parse("a$F.exr").path(123), "a123.exr");
  EXPECT_EQ(FramePattern::parse("######").path(1001), "001001");
  EXPECT_EQ(FramePattern::parse("a.##.exr").path(12345), "a.12345.exr");
  EXPECT_EQ(FramePattern::parse("a.%010d.exr").path(5), "a.0000000005.exr");
}

TEST(FramePattern, LeavesFoldersAlone) {
  const FramePattern pattern = FramePattern::parse("shot #1/%d/{x}.####.exr");
  EXPECT_EQ(pattern.path(2), "shot #1/%d/{x}.0002.exr");
  EXPECT_EQ(pattern.folder(), "shot #1/%d");
  EXPECT_EQ(FramePattern::parse("####.exr").folder(), ".");
}

TEST(FramePattern, RefusesNoneOrSeveralPlaces) {
  for (const char* text : {"a.exr", "####/a.exr", "a.####.##.exr", "a.%04d.$F4.exr", "a.%s.exr", "a.%4d.exr",
                           "a.%0d.exr", "a.%012", "a.%", "a.$", "a.$G4.exr", ""})
    EXPECT_THROW(FramePattern::parse(text), Error) << text;
}

TEST(FramePattern, CountsPlacesInTheFileName) {
  EXPECT_EQ(FramePattern::places("a.vdb"), 0);
  EXPECT_EQ(FramePattern::places("a.####/b.vdb"), 0);
  EXPECT_EQ(FramePattern::places("50% of a.$F4.vdb"), 1);
  EXPECT_EQ(FramePattern::places("a.##.%04d.vdb"), 2);
}

}  // namespace
}  // namespace nephele
