#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "nephele/modeling/field/operations.h"
#include "tests/modeling/felt/felt_run.h"

namespace nephele::felt {
namespace {

/// Texts of expressions of fields, drawn at random.
class Drawn {
 public:
  explicit Drawn(unsigned seed) : random_(seed) {}

  std::string scalar(int depth) {
    if (depth == 0) {
      switch (below(6)) {
        case 0:
          return number();
        case 1:
          return "P." + std::string(1, "xyz"[below(3)]);
        case 2:
          return "sphere(" + point() + ", " + number() + ")";
        case 3:
          return "perlin(" + number() + ", seed = " + std::to_string(below(9)) + ")";
        case 4:
          return "box(" + point() + ", (1, 2, 1.5))";
        default:
          return "noise(\"simplex\", frequency = " + number() + ")";
      }
    }
    const std::string a = scalar(depth - 1);
    switch (below(14)) {
      case 0:
        return "(" + a + " + " + scalar(depth - 1) + ")";
      case 1:
        return "(" + a + " - " + scalar(depth - 1) + ")";
      case 2:
        return a + " * " + scalar(0);
      case 3:
        return "(" + a + ") / (2 + abs(" + scalar(0) + "))";
      case 4:
        return "-(" + a + ")";
      case 5:
        return "min(" + a + ", " + scalar(depth - 1) + ")";
      case 6:
        return "max(" + a + ", " + scalar(depth - 1) + ")";
      case 7:
        return "sin(" + a + ")";
      case 8:
        return "abs(" + a + ") ^ 0.5";
      case 9:
        return "clamp(" + a + ", -1, 1)";
      case 10:
        return "smoothstep(-1, 1, " + a + ")";
      case 11:
        return vector(depth - 1) + " * " + vector(0);
      case 12:
        return "compose(" + a + ", P * 0.5 + " + point() + ")";
      default:
        return "mask(" + a + ", 0.5)";
    }
  }
  std::string vector(int depth) {
    if (depth == 0) return below(2) == 0 ? "P" : point();
    switch (below(4)) {
      case 0:
        return "(" + vector(depth - 1) + " + " + vector(0) + ")";
      case 1:
        return "cross(" + vector(depth - 1) + ", " + vector(0) + ")";
      case 2:
        return "normalize(" + vector(depth - 1) + ")";
      default:
        return "(" + scalar(0) + ", " + number() + ", " + scalar(depth - 1) + ")";
    }
  }
  float coordinate() { return std::uniform_real_distribution<float>(-2, 2)(random_); }

 private:
  int below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }
  std::string number() { return std::to_string(1 + below(30)) + ".0 / 10"; }
  std::string point() {
    return "(0." + std::to_string(below(9)) + ", 0.2, -0." + std::to_string(below(9)) + ")";
  }

  std::mt19937 random_;
};

const std::vector<Given>& place() {
  static const std::vector<Given> given{{"P", {Kind::vectorField}, identity()}};
  return given;
}

ScalarField fieldOf(const std::string& text) {
  Context context;
  return ExpressionText("drawn", text, {Kind::scalarField}, allFunctions(), place())
      .evaluate(context)
      .as<ScalarField>();
}

TEST(FeltRandomExpressions, BlocksEqualSinglePointsAndRangesHoldThem) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    Drawn drawn(seed);
    const std::string text = drawn.scalar(1 + static_cast<int>(seed % 4));
    const ScalarField field = fieldOf(text);
    std::vector<float> x(70), y(70), z(70), values(70);
    Box box;
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] = drawn.coordinate();
      y[i] = drawn.coordinate();
      z[i] = drawn.coordinate();
      box = box.including({x[i], y[i], z[i]});
    }
    field.eval({x, y, z}, values);
    const Interval range = field.range(box);
    for (std::size_t i = 0; i < x.size(); ++i) {
      const float alone = field({x[i], y[i], z[i]});
      ASSERT_TRUE(std::memcmp(&alone, &values[i], sizeof alone) == 0) << text;
      ASSERT_TRUE(std::isnan(alone) || (alone >= range.min && alone <= range.max))
          << text << ": " << alone << " is not within " << range.min << " to " << range.max;
    }
  }
}

TEST(FeltRandomExpressions, FormattingChangesNothingButSpaces) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    Drawn drawn(seed);
    const std::string text = "scalarfield f = " + drawn.scalar(1 + static_cast<int>(seed % 5)) + ";\n";
    const std::string once = formattedScript("s.felt", text);
    EXPECT_EQ(formattedScript("s.felt", once), once);
    const auto withoutSpaces = [](std::string s) {
      s.erase(std::remove_if(s.begin(), s.end(), [](char c) { return c == ' ' || c == '\n'; }), s.end());
      return s;
    };
    EXPECT_EQ(withoutSpaces(once), withoutSpaces(text));
    const float before = fieldOf(text.substr(16, text.size() - 18))({0.3f, 0.1f, -0.7f});
    const float after = fieldOf(once.substr(16, once.size() - 18))({0.3f, 0.1f, -0.7f});
    EXPECT_TRUE(std::memcmp(&before, &after, sizeof before) == 0) << once;
  }
}

TEST(FeltRandomExpressions, PlainValuesAreReadAsTheyAreWritten) {
  const auto readAgain = [](const Value& value, const Type& type) {
    Context context;
    const std::string text = literalText(value, type);
    return literalText(ExpressionText("literal", text, type, allFunctions()).evaluate(context), type) == text;
  };
  EXPECT_TRUE(readAgain(0.1 + 0.2, {Kind::number}));
  EXPECT_TRUE(readAgain(1e300, {Kind::number}));
  EXPECT_TRUE(readAgain(-5.0, {Kind::number}));
  EXPECT_TRUE(readAgain(std::int64_t(-7), {Kind::integer}));
  EXPECT_TRUE(readAgain(true, {Kind::boolean}));
  EXPECT_TRUE(readAgain(std::string("a \"b\"\n\tc\\"), {Kind::text}));
  EXPECT_TRUE(readAgain(Vec3d{1, -2.5, 1e-9}, {Kind::vector}));
}

}  // namespace
}  // namespace nephele::felt
