#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "nephele/modeling/felt/program.h"
#include "tests/modeling/felt/felt_run.h"

namespace nephele::felt {
namespace {

// What is expected follows from C's rules of precedence and arithmetic, where nothing else is said.

TEST(FeltLanguage, NumbersFollowTheRulesOfC) {
  EXPECT_EQ(printed("print(1 + 2 * 3, (1 + 2) * 3, 7 / 2, -7 / 2, 7 % 3, -7 % 3);"), "7 9 3 -3 1 -1\n");
  EXPECT_EQ(printed("print(7.0 / 2, 7 / 2.0, 1e3, .5, 5%3);"), "3.5 3.5 1000 0.5 2\n");
  EXPECT_EQ(printed("print(1 < 2, 2 <= 2, 1 == 2, 1 != 2, !true, true && false || true);"),
            "true true false true false true\n");
  EXPECT_EQ(printed("print(1 > 2 ? \"a\" : \"b\");"), "b\n");
}

TEST(FeltLanguage, LinesEndAsAnySystemEndsThem) {
  for (const std::string& end : {std::string("\n"), std::string("\r\n"), std::string("\r")})
    EXPECT_EQ(printed("// one" + end + "print(1); // and" + end + "print(2);" + end), "1\n2\n");
}

TEST(FeltLanguage, PowersBindTighterThanSignsAndToTheRight) {
  EXPECT_EQ(printed("print(-2 ^ 2, 2 ^ 3 ^ 2, 2 ^ -1);"), "-4 512 0.5\n");
}

TEST(FeltLanguage, LogicStopsWhereTheResultIsKnown) {
  EXPECT_EQ(printed("bool b = false && 1 / 0 == 1; print(b, true || 1 / 0 == 1);"), "false true\n");
}

TEST(FeltLanguage, VectorsAndMatricesMultiplyAsInTheNotes) {
  EXPECT_EQ(printed("print((1, 2, 3) * (4, 5, 6), (1, 2, 3) * 2, 2 * (1, 2, 3), (2, 4, 6) / 2);"),
            "32 (2, 4, 6) (2, 4, 6) (1, 2, 3)\n");
  EXPECT_EQ(
      printed("matrix m = ((1,2,3),(4,5,6),(7,8,9)); print(m * (1,0,0), (1,0,0) * m, m[1], (m * m)[0]);"),
      "(1, 4, 7) (1, 2, 3) (4, 5, 6) (30, 36, 42)\n");
  EXPECT_EQ(printed("vector v = (1,2,3); print(v.x, v.y, v.z, v[2]);"), "1 2 3 3\n");
}

TEST(FeltLanguage, FieldsFollowTheSameRulesAsTheirValues) {
  EXPECT_EQ(
      printed("vectorfield X = identity(); vector p = (1,2,3);\n"
              "print(eval(X * X, p), eval(2 * X, p), eval(X.y ^ 2, p), eval(-X / 2, p), eval(X[0] + 1, p));"),
      "14 (2, 4, 6) 4 (-0.5, -1, -1.5) 2\n");
  EXPECT_EQ(printed("print(eval(((0,1,0),(1,0,0),(0,0,1)) * identity(), (1,2,3)));"), "(2, 1, 3)\n");
  EXPECT_EQ(printed("matrixfield M = matrixfield((0,1,0),(0,0,1),(1,0,0));\n"
                    "print(eval(M * identity(), (1,2,3)), eval(identity() * M, (1,2,3)));"),
            "(2, 3, 1) (3, 1, 2)\n");
  EXPECT_EQ(printed("print(eval((identity().x, 7, 0), (5,0,0)));"), "(5, 7, 0)\n");
}

TEST(FeltLanguage, NumbersStandForConstantFields) {
  EXPECT_EQ(printed("scalarfield f = 3; vectorfield v = (1,2,3); print(eval(f, (0,0,0)), eval(v, (9,9,9)));"),
            "3 (1, 2, 3)\n");
}

TEST(FeltLanguage, LoopsCountLeaveAndGoOn) {
  EXPECT_EQ(
      printed(
          "int sum = 0; for (int i = 0; i < 10; i++) { if (i == 3) continue; if (i == 6) break; sum += i; }"
          " print(sum);"),
      "12\n");
  EXPECT_EQ(printed("int n = 5; int f = 1; while (n > 1) f *= n--; print(f);", false), "");
  EXPECT_EQ(printed("int n = 5; int f = 1; while (n > 1) { f *= n; --n; } print(f);"), "120\n");
}

TEST(FeltLanguage, ArraysGrowAtTheirEndAndAreValues) {
  EXPECT_EQ(printed("int[] a; for (int i = 0; i < 4; ++i) a[i] = i * i; int[] b = a; b[0] = 7; a[1] += 10;"
                    " print(a, b, size(a));"),
            "[0, 11, 4, 9] [7, 1, 4, 9] 4\n");
  EXPECT_EQ(
      printed("float[] a = [1, 2.5]; scalarfield[] f = [1, identity().x]; print(a, eval(f[1], (4,0,0)));"),
      "[1, 2.5] 4\n");
  EXPECT_EQ(printed("float[] none = []; print(size(none), none);"), "0 []\n");
  // The index is evaluated once, whatever is evaluated beside it.
  EXPECT_EQ(printed("int calls = 0; int[] a = [1, 2, 3]; func int next() { calls += 1; return calls - 1; }\n"
                    "func int inner() { a[2] += 100; return 10; }\n"
                    "a[next()] += 5; a[next()] *= inner(); a[next()]++; print(a, calls);"),
            "[6, 20, 104] 3\n");
}

TEST(FeltLanguage, FunctionsHaveOverloadsDefaultsAndNames) {
  EXPECT_EQ(printed("func int twice(int a) { return 2 * a; }\nfunc string twice(string a) { return a + a; }\n"
                    "print(twice(4), twice(\"ab\"));"),
            "8 abab\n");
  EXPECT_EQ(printed("func float f(float a, float b = 10, float c = 100) { return a + b + c; }\n"
                    "print(f(1), f(1, 2), f(1, c = 3), f(c = 1, a = 2, b = 3));"),
            "111 103 14 6\n");
  EXPECT_EQ(
      printed("func int fib(int n) { if (n < 2) return n; return fib(n - 1) + fib(n - 2); } print(fib(15));"),
      "610\n");
  EXPECT_EQ(
      printed("func int later() { return sooner(); }\nfunc int sooner() { return 3; }\nprint(later());"),
      "3\n");
}

TEST(FeltLanguage, NamesMayHideThoseOfBuiltInsAndOfTheirOwnFunction) {
  EXPECT_EQ(printed("func float sphere(vector c, float r) { return r; } print(sphere((0,0,0), 5));"), "5\n");
  EXPECT_EQ(printed("func float f() { float f = 3; return f; } print(f());"), "3\n");
  EXPECT_EQ(printed("scalarfield sphere = sphere((0,0,0), 2); print(eval(sphere, (0,0,0)));"), "2\n");
}

TEST(FeltLanguage, BlocksEndTheLivesOfTheirNames) {
  EXPECT_EQ(printed("int a = 1; { int a = 2; print(a); } print(a);"), "2\n1\n");
  EXPECT_EQ(printed("int a = 1; func int f() { return a; } a = 5; print(f());"), "5\n");
}

TEST(FeltLanguage, SharesOfTheLongestSideNeedAShape) {
  Context context;
  context.longestSide = 4;
  EXPECT_EQ(printed("print(2.5%, 6x, 50% + 1);", true, &context), "0.1 1.5 3\n");
}

TEST(FeltLanguage, ParametersAreSetFromOutside) {
  const std::string script =
      "param float gain = 1.2 in [0, 4] \"how bright\";\n"
      "param string kind = \"perlin\" in [\"perlin\", \"worley\"];\n"
      "param vector tint = (1, 0.5, 0) in color \"of the light\";\n"
      "print(gain, kind, tint);";
  EXPECT_EQ(printed(script), "1.2 perlin (1, 0.5, 0)\n");
  const Program program("s.felt", script, allFunctions());
  EXPECT_EQ(printedBy(program, {{"gain", "1 + 2"}, {"kind", "worley"}, {"tint", "(0, 0, 1)"}}),
            "3 worley (0, 0, 1)\n");
  ASSERT_EQ(program.parameters().size(), 3u);
  EXPECT_EQ(program.parameters()[0].standard, "1.2");
  EXPECT_EQ(program.parameters()[0].allowed, (std::vector<std::string>{"0", "4"}));
  EXPECT_FALSE(program.parameters()[0].isChoice);
  EXPECT_EQ(program.parameters()[0].text, "how bright");
  EXPECT_TRUE(program.parameters()[1].isChoice);
  EXPECT_TRUE(program.parameters()[2].isColor);
  EXPECT_THROW(printedBy(program, {{"gian", "1"}}), Error);
  EXPECT_THROW(printedBy(program, {{"gain", "5"}}), ScriptError);
  EXPECT_THROW(printedBy(program, {{"kind", "simplex"}}), ScriptError);
  EXPECT_THROW(printedBy(program, {{"gain", "\"x\""}}), ScriptError);
}

TEST(FeltLanguage, FilesAreImportedOnceAndSoughtBesideTheScript) {
  const auto folder = std::filesystem::temp_directory_path() / "nephele felt imports";
  std::filesystem::create_directories(folder / "more");
  std::ofstream(folder / "more" / "a.felt") << "import \"b.felt\";\nfunc int a() { return b() + 1; }\n";
  std::ofstream(folder / "more" / "b.felt") << "import \"a.felt\";\nfunc int b() { return 1; }\n";
  std::ofstream(folder / "main.felt") << "import \"more/a.felt\";\nimport \"more/b.felt\";\nprint(a());\n";
  const Program program = Program::fromFile((folder / "main.felt").string(), allFunctions());
  EXPECT_EQ(printedBy(program), "2\n");
  std::filesystem::remove_all(folder);
}

TEST(FeltLanguage, GivenNamesAreThereAndMayBeHidden) {
  const std::vector<Given> given{{"time", {Kind::number}, 2.0}};
  EXPECT_EQ(printedBy(Program("s.felt", "print(time * 2);", allFunctions(), given)), "4\n");
  EXPECT_EQ(printedBy(Program("s.felt", "float time = 7; print(time);", allFunctions(), given)), "7\n");
  const ExpressionText text("--gain", "lerp(1, 3, P.y) * time", {Kind::scalarField}, allFunctions(),
                            {{"P", {Kind::vectorField}, identity()}, given[0]});
  Context context;
  EXPECT_FLOAT_EQ(text.evaluate(context).as<ScalarField>()({0, 0.5f, 0}), 4.0f);
}

TEST(FeltLanguage, ASessionKeepsWhatItWasTold) {
  Context context;
  Session session(allFunctions(), context);
  session.enter("float a = 2;");
  session.enter("func float f(float x) { return x * a; }");
  const Named value = session.enter("f(4) + 1");
  EXPECT_EQ(shown(value.value, value.type), "9");
  session.enter("float a = 3;");
  EXPECT_THROW(session.enter("b = 3;"), ScriptError);
  EXPECT_THROW(session.enter("f(\"x\")"), ScriptError);
  const Named again = session.enter("a");
  EXPECT_EQ(shown(again.value, again.type), "3");
}

TEST(FeltLanguage, LimitsOfASessionHoldForEachEntry) {
  Context context;
  context.limits.statements = 100;
  Session session(allFunctions(), context);
  session.enter("func int turns() { int n = 0; while (n < 40) n++; return n; }");
  for (int i = 0; i < 10; ++i) EXPECT_EQ(session.enter("turns()").value.as<std::int64_t>(), 40);
  EXPECT_THROW(session.enter("while (true) { }"), ScriptError);
  EXPECT_EQ(session.enter("turns()").value.as<std::int64_t>(), 40);
  session.enter("int a = turns();");
}

TEST(FeltLanguage, WhatIsReadTwiceIsEvaluatedOnce) {
  // Without remembering, each step would evaluate the one before twice, and this would not end.
  const std::string script =
      "scalarfield f = perlin(3); for (int i = 0; i < 60; i++) f = f * f + f / 2;\n"
      "print(eval(f, (0.1, 0.2, 0.3)) < 1e30);";
  EXPECT_EQ(printed(script), "true\n");
}

TEST(FeltLanguage, RunsOfOneProgramDoNotKnowEachOther) {
  const Program program("s.felt", "int[] a; a[size(a)] = 1; print(size(a));", allFunctions());
  EXPECT_EQ(printedBy(program), "1\n");
  EXPECT_EQ(printedBy(program), "1\n");
}

}  // namespace
}  // namespace nephele::felt
