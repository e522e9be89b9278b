#include <gtest/gtest.h>

#include "nephele/modeling/felt/program.h"

namespace nephele::felt {
namespace {

std::string formatted(const std::string& text) {
  const std::string once = formattedScript("s.felt", text);
  EXPECT_EQ(formattedScript("s.felt", once), once);
  return once;
}

TEST(FeltFormatter, SpacesOperatorsAndIndentsBlocks) {
  EXPECT_EQ(formatted("for(int i=0;i<3;i++){if(i==-1){a[i]=-i^2;}else print( \"x\",!b );}"),
            "for (int i = 0; i < 3; i++) {\n"
            "  if (i == -1) {\n"
            "    a[i] = -i ^ 2;\n"
            "  } else print(\"x\", !b);\n"
            "}\n");
  EXPECT_EQ(formatted("func  scalarfield[]  f(scalarfield a,int b=2){return [a,-a];}\n"),
            "func scalarfield[] f(scalarfield a, int b = 2) {\n  return [a, -a];\n}\n");
  EXPECT_EQ(formatted("a = b*(c-d)/2.5% ;x=(1,-2,3).y;"), "a = b * (c - d) / 2.5%;\nx = (1, -2, 3).y;\n");
}

TEST(FeltFormatter, KeepsCommentsEmptyLinesAndLineBreaksInStatements) {
  EXPECT_EQ(formatted("// one\n\n\n\nint a=1; // two\n/* three */\nint b=2;\n"),
            "// one\n\nint a = 1;  // two\n/* three */\nint b = 2;\n");
  EXPECT_EQ(formatted("int[] a=[1,\n2,\n   3];\n"), "int[] a = [1,\n    2,\n    3];\n");
  EXPECT_EQ(formatted("if (a) {\n\n  // inside\n  b();\n\n}\n"), "if (a) {\n  // inside\n  b();\n\n}\n");
}

TEST(FeltFormatter, RefusesWhatHasNoEnd) {
  EXPECT_THROW(formattedScript("s.felt", "print(\"abc"), ScriptError);
  EXPECT_THROW(formattedScript("s.felt", "/* abc"), ScriptError);
  EXPECT_THROW(formattedScript("s.felt", "for (int i = 0; i < 3; i++) { print((1, 2, 3);"), ScriptError);
  EXPECT_EQ(formattedScript("s.felt", ""), "");
}

}  // namespace
}  // namespace nephele::felt
