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

// Sample (i, j, k) of the region is at -0.95 + 0.1 (i, j, k).
TEST(FlowFunctions, TdivfreeLeavesNoDivergenceAtTheCentresOfCells) {
  for (const std::string walls : {"", ", \"closed\"", ", walls = \"periodic\""}) {
    std::ostringstream script;
    script << kRegion << "vectorfield u = perlin(3) * (1,2,3);\nvectorfield v = tdivfree(u, region" << walls
           << ");\nfor (int i = 0; i < 20; i = i + 1) {\n  vector p = (-0.95 + 0.1 * i, 0.05, 0.25);\n"
              "  print(abs(eval(div(v), p)), abs(eval(div(u), p)));\n}\n";
    std::istringstream numbers(printed(script.str()));
    double after, before, sum = 0;
    int lines = 0;
    while (numbers >> after >> before) {
      EXPECT_LT(after, 1e-4) << walls;
      sum += before;
      ++lines;
    }
    EXPECT_EQ(lines, 20);
    EXPECT_GT(sum, 1) << walls;
  }
}

TEST(FlowFunctions, TdivfreeOfARegionWhoseCellsDoNotDivideItFillsIt) {
  EXPECT_EQ(printed("domain region = domain((0,0,0), (1,1,1), (0,0,0), 0.3, 0.3, 0.3);\n"
                    "vectorfield v = tdivfree(vectorfield((1,0,0)), region);\n"
                    "print(eval(v, (0.999, 0.5, 0.001)).x > 0.999, eval(v, (1.6, 0.5, 0.5)).x);"),
            "true 0\n");
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
