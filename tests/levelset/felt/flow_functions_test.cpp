#include "nephele/levelset/felt/flow_functions.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/felt/program.h"

namespace nephele::felt {
namespace {

const Registry& functions() {
  static const Registry* const registry = [] {
    auto* made = new Registry;
    addModelingFunctions(*made);
    addFlowFunctions(*made);
    return made;
  }();
  return *registry;
}

/// What a script prints.
std::string printed(const std::string& script) {
  Context context;
  std::string text;
  context.print = [&](const std::string& line) { text += line + "\n"; };
  Program("s.felt", script, functions()).run(context);
  return text;
}

const std::string kRegion = "domain region = domain((-1,-1,-1), (2,2,2), (0,0,0), 0.1, 0.1, 0.1);\n";

// Corner (i, j, k) is at -1 + 0.1 (i, j, k).
TEST(FlowFunctions, TdivfreeLeavesNoDivergenceAtTheCornersOfCells) {
  for (const std::string walls : {"", ", \"closed\"", ", walls = \"periodic\""}) {
    std::ostringstream script;
    script << kRegion << "vectorfield u = perlin(3) * (1,2,3);\nvectorfield v = tdivfree(u, region" << walls
           << ");\nfor (int i = 0; i <= 20; i = i + 1) {\n  vector p = (-1 + 0.1 * i, 0.1, 0.3);\n"
              "  print(abs(eval(div(v), p)), abs(eval(div(u), p)));\n}\n";
    std::istringstream numbers(printed(script.str()));
    double after, before, sum = 0;
    int lines = 0;
    while (numbers >> after >> before) {
      EXPECT_LT(after, 1e-4) << walls;
      sum += before;
      ++lines;
    }
    EXPECT_EQ(lines, 21);
    EXPECT_GT(sum, 1) << walls;
  }
}

TEST(FlowFunctions, TdivfreeGoesOnBeyondARegion) {
  const std::string flow = "vectorfield v = tdivfree(perlin(3) * (1,2,3), region";
  EXPECT_EQ(printed(kRegion + flow +
                    ");\nvector a = eval(v, (0.33, 0.9, -0.71)), b = eval(v, (2.33, -1.1, -4.71));\n"
                    "print(sqrt(a * a) > 0.01, sqrt((a - b) * (a - b)) < 0.00001);"),
            "true true\n");
  EXPECT_EQ(printed(kRegion + flow +
                    ", \"closed\");\nvector a = eval(v, (0.33, 1, -0.71)), b = eval(v, (0.33, 7, "
                    "-0.71));\nprint(abs(a.y) < 0.00001, sqrt((a - b) * (a - b)) < 0.01);"),
            "true true\n");
}

TEST(FlowFunctions, TdivfreeNamesTheWallsThatThereAre) {
  try {
    printed(kRegion + "vectorfield v = tdivfree(identity(), region, \"open\");");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("\"periodic\" or \"closed\""), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace nephele::felt
