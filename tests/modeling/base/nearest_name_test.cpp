#include "nephele/modeling/base/nearest_name.h"

#include <gtest/gtest.h>

namespace nephele {
namespace {

TEST(NearestName, IsTheOneWithTheFewestEdits) {
  const std::vector<std::string> names{"frequency", "bias", "billow", "seed"};
  EXPECT_EQ(nearestName("frequncy", names), "frequency") << "a letter less";
  EXPECT_EQ(nearestName("frequenncy", names), "frequency") << "a letter more";
  EXPECT_EQ(nearestName("frequenzy", names), "frequency") << "another letter";
  EXPECT_EQ(nearestName("bisa", names), "bias") << "two exchanged are one edit";
  EXPECT_EQ(nearestName("Seed", names), "seed");
  EXPECT_EQ(nearestName("colour", names), "") << "a third of the letters may differ";
  EXPECT_EQ(nearestName("", names), "");
  EXPECT_EQ(nearestName(std::string(65, 'x'), {std::string(65, 'x')}), "");
}

}  // namespace
}  // namespace nephele
