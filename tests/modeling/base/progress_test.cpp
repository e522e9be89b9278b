#include "nephele/modeling/base/progress.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace nephele {
namespace {

class Recorder final : public Progress {
 public:
  void begin(std::string_view stage) const override { stages.emplace_back(stage); }
  void advance(double fraction) const override { fractions.push_back(fraction); }
  void note(std::string_view message) const override { notes.emplace_back(message); }
  bool cancelled() const override { return stop; }

  mutable std::vector<std::string> stages, notes;
  mutable std::vector<double> fractions;
  bool stop = false;
};

TEST(SubProgress, TakesItsShareOfTheStage) {
  const Recorder whole;
  const SubProgress second(whole, 0.25, 0.75);
  second.begin("inner");
  for (const double fraction : {0.0, 0.5, 1.0}) second.advance(fraction);
  EXPECT_EQ(whole.fractions, (std::vector<double>{0.25, 0.5, 0.75}));
  EXPECT_TRUE(whole.stages.empty());
}

TEST(SubProgress, OfASubProgressIsAShareOfAShare) {
  const Recorder whole;
  const SubProgress half(whole, 0.5, 1);
  const SubProgress quarter(half, 0.5, 1);
  quarter.advance(0.5);
  EXPECT_EQ(whole.fractions, (std::vector<double>{0.875}));
}

TEST(SubProgress, PassesOnNotesAndCancelling) {
  Recorder whole;
  const SubProgress part(whole, 0, 0.5);
  part.note("filled 5 holes");
  EXPECT_EQ(whole.notes, (std::vector<std::string>{"filled 5 holes"}));
  EXPECT_NO_THROW(part.check());
  whole.stop = true;
  EXPECT_THROW(part.check(), Cancelled);
}

}  // namespace
}  // namespace nephele
