#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/modeling/felt/felt_run.h"

namespace nephele::felt {
namespace {

struct Pair {
  Code code;
  std::string script;
  std::string message;
};

std::string nested(int count) {
  return "print(" + std::string(std::size_t(count), '(') + "1" + std::string(std::size_t(count), ')') + ");";
}

/// A script for every code, and all that is said of it.
const std::vector<Pair>& pairs() {
  static const std::vector<Pair> all{
      {Code::badCharacter, "int a = 3 @ 4;",
       "s.felt:1:11: error: '@' means nothing here\n  int a = 3 @ 4;\n            ^"},
      {Code::badNumber, "print(12abc);",
       "s.felt:1:7: error: '12abc' is no number of this language\n  print(12abc);\n        ^~~~~\n"
       "  hint: write 3, 0.5, 1e-3, 2.5% of the longest side, or 6x for six per longest side; integers end "
       "at "
       "9223372036854775807"},
      {Code::openString, "print(\"abc);",
       "s.felt:1:7: error: this string has no end\n  print(\"abc);\n        ^~~~~~\n"
       "  hint: end it with \" in the same line"},
      {Code::openComment, "int a = 1; /* and so on",
       "s.felt:1:12: error: this comment has no end\n  int a = 1; /* and so on\n             ^~\n"
       "  hint: end it with */"},
      {Code::expected, "float y = 3\nfloat z = y;",
       "s.felt:1:12: error: expected ';' before the end of the line\n  float y = 3\n             ^"},
      {Code::tooDeep, nested(250),
       "s.felt:1:205: error: more than 200 brackets or blocks in each other\n  ..." + std::string(80, '(') +
           std::string(1, '(') + std::string(51, '(') + "1" + std::string(25, ')') + "...\n     " +
           std::string(80, ' ') + "^"},
      {Code::unknownName, "scalarfield r = 1;\nvectorfield v = grad(rr);",
       "s.felt:2:22: error: there is no 'rr' here\n  vectorfield v = grad(rr);\n                       ^~\n"
       "  hint: did you mean `r`?"},
      {Code::unknownFunction, "print(identitty());",
       "s.felt:1:7: error: there is no function 'identitty'\n  print(identitty());\n        ^~~~~~~~~\n"
       "  hint: did you mean `identity`?"},
      {Code::unknownType, "foat x = 1;",
       "s.felt:1:1: error: there is no type 'foat'\n  foat x = 1;\n  ^~~~\n  hint: did you mean `float`?"},
      {Code::unknownParameter, "print(noise(freqency = 3));",
       "s.felt:1:13: error: 'noise' has no parameter 'freqency'\n  print(noise(freqency = 3));\n"
       "              ^~~~~~~~\n  hint: did you mean `frequency`?"},
      {Code::declaredTwice, "int a = 1;\nint a = 2;",
       "s.felt:2:5: error: 'a' is declared twice\n  int a = 2;\n      ^\n"
       "  hint: assign to it without a type, or choose another name"},
      {Code::noSuchCall, "scalarfield s = sphere((0,0,0), \"big\");",
       "s.felt:1:17: error: no 'sphere' takes (vector, string)\n  scalarfield s = sphere((0,0,0), \"big\");\n"
       "                  ^~~~~~~~~~~~~~~~~~~~~~\n"
       "  hint: there is scalarfield sphere(vector center, float radius)"},
      {Code::ambiguousCall,
       "func int f(float a, int b) { return 1; }\nfunc int f(int a, float b) { return 2; }\nprint(f(1, 2));",
       "s.felt:3:7: error: several functions 'f' take (int, int) equally well\n  print(f(1, 2));\n"
       "        ^~~~~~~\n  hint: convert an argument by hand, as in float(...) or scalarfield(...)"},
      {Code::wrongType, "int i = 2.5;",
       "s.felt:1:9: error: 'i' is an int, and this is a float\n  int i = 2.5;\n          ^~~\n"
       "  hint: int(...) leaves out what is after the point"},
      {Code::noSuchMember, "print((1,2,3).w);",
       "s.felt:1:15: error: a vector has no '.w'\n  print((1,2,3).w);\n                ^\n"
       "  hint: vectors and vector fields have .x, .y and .z"},
      {Code::noSuchIndex, "float a = 1; print(a[0]);",
       "s.felt:1:20: error: a float has no elements\n  float a = 1; print(a[0]);\n                     ^~~~\n"
       "  hint: arrays, vectors and matrices have"},
      {Code::notAssignable, "1 + 2 = 3;",
       "s.felt:1:1: error: nothing can be assigned to this\n  1 + 2 = 3;\n  ^~~~~\n"
       "  hint: assign to a variable, or to an element of an array"},
      {Code::noReturn, "func float g(float a) { if (a > 0) return a; }",
       "s.felt:1:12: error: 'g' may end without returning a float\n"
       "  func float g(float a) { if (a > 0) return a; }\n             ^\n"
       "  hint: let every way through it end with return"},
      {Code::outsideFunction, "return 3;",
       "s.felt:1:1: error: this return is in no function\n  return 3;\n  ^~~~~~~~~"},
      {Code::outsideLoop, "break;", "s.felt:1:1: error: this break is in no loop\n  break;\n  ^~~~~~"},
      {Code::notAtTop, "{ param int a = 1; }",
       "s.felt:1:3: error: 'param' stands inside of a block\n  { param int a = 1; }\n    ^~~~~\n"
       "  hint: functions, parameters and imports stand outside of all braces"},
      {Code::badRange, "param float a = 1 in [3];",
       "s.felt:1:13: error: the range of 'a' has one end\n  param float a = 1 in [3];\n              ^\n"
       "  hint: in [lowest, highest]"},
      {Code::outOfRange, "int[] a = [1, 2]; print(a[2]);",
       "s.felt:1:27: error: there is no element 2 in an array of 2\n  int[] a = [1, 2]; print(a[2]);\n"
       "                            ^\n  hint: elements are numbered from 0"},
      {Code::importFailed, "import \"no such file.felt\";",
       "s.felt:1:1: error: no such file.felt: cannot be opened for reading\n  import \"no such file.felt\";\n"
       "  ^~~~~~~~~~~~~~~~~~~~~~~~~~~\n  hint: files are sought beside the script that imports them"},
      {Code::noValue, "float a; print(a);",
       "s.felt:1:16: error: 'a' has no value yet\n  float a; print(a);\n                 ^\n"
       "  hint: assign to it before it is read"},
      {Code::divisionByZero, "float a = 0;\nprint(1 / a);",
       "s.felt:2:7: error: division by zero\n  print(1 / a);\n        ^~~~~"},
      {Code::overflow, "print(9223372036854775807 + 1);",
       "s.felt:1:7: error: the result is no integer of 64 bits\n  print(9223372036854775807 + 1);\n"
       "        ^~~~~~~~~~~~~~~~~~~~~~~\n  hint: float(...) has a wider range"},
      {Code::limit, "func int f(int i) { return f(i + 1); }\nprint(f(0));",
       "s.felt:1:28: error: 200 calls are under way at the same time\n"
       "  func int f(int i) { return f(i + 1); }\n                             ^~~~~~~~\n"
       "  hint: does 'f' call itself for ever? the limit max-calls allows more\n"
       "  called at s.felt:1:28\n  called at s.felt:1:28\n  called at s.felt:1:28\n  called at s.felt:1:28\n"
       "  called at s.felt:1:28\n  called at s.felt:1:28\n  called at s.felt:1:28\n  called at s.felt:1:28\n"
       "  ... and 192 calls more"},
      {Code::outOfRange, "scalarfield s = shell(sphere((0,0,0), 1), -1);",
       "s.felt:1:17: error: shell: thickness must be > 0 and finite, got -1\n"
       "  scalarfield s = shell(sphere((0,0,0), 1), -1);\n"
       "                  ^~~~~~~~~~~~~~~~~~~~~~~~~~~~~"},
  };
  return all;
}

TEST(FeltMessages, AreExactlyTheseForEveryCode) {
  std::set<Code> seen;
  for (const Pair& pair : pairs()) {
    EXPECT_EQ(faultsOf(pair.script), pair.message) << pair.script;
    seen.insert(pair.code);
    try {
      printedBy(Program("s.felt", pair.script, allFunctions()));
    } catch (const ScriptError& error) {
      EXPECT_TRUE(std::any_of(error.diagnostics().begin(), error.diagnostics().end(),
                              [&](const Diagnostic& fault) { return fault.code == pair.code; }))
          << pair.script;
      EXPECT_EQ(error.isOfScript(), pair.code != Code::importFailed);
    }
  }
  // Files and grids are not the script's fault.
  Registry registry;
  addModelingFunctions(registry);
  registry.beginData();
  registry.add("float readnumber(string path)", "Reads.", "float a = readnumber(\"a\");",
               [](const std::string& path) -> double { throw Error(path + ": cannot be read"); });
  try {
    printedBy(Program("s.felt", "print(readnumber(\"a\"));", registry));
    ADD_FAILURE() << "no fault";
  } catch (const ScriptError& error) {
    EXPECT_FALSE(error.isOfScript());
    EXPECT_EQ(error.what(), std::string("s.felt:1:7: error: a: cannot be read\n  print(readnumber(\"a\"));\n"
                                        "        ^~~~~~~~~~~~~~~"));
    seen.insert(error.diagnostics()[0].code);
  }
  // The one that is a warning.
  const Program program("s.felt", "print(1/2);", allFunctions());
  ASSERT_EQ(program.warnings().size(), 1u);
  EXPECT_EQ(formatted(program.warnings()[0], program.sources()),
            "s.felt:1:7: warning: 1/2 of integers is 0\n  print(1/2);\n        ^~~\n"
            "  hint: write 1.0/2 for a fraction");
  seen.insert(program.warnings()[0].code);
  for (const Code code : allCodes()) EXPECT_TRUE(seen.count(code)) << codeName(code);
}

TEST(FeltMessages, TellAllFaultsOfARunInTheirOrder) {
  const std::string text = faultsOf("foo();\nint a = ;\nfloat b = \"x\";\nprint(c);");
  const std::vector<std::string> places{"s.felt:1:1:", "s.felt:2:9:", "s.felt:3:11:", "s.felt:4:7:"};
  std::size_t last = 0;
  for (const std::string& place : places) {
    const std::size_t at = text.find(place);
    EXPECT_NE(at, std::string::npos) << place << "\n" << text;
    EXPECT_GE(at, last);
    last = at;
  }
  EXPECT_EQ(text.find("'a'"), std::string::npos) << "a name whose declaration is broken is not unknown";
}

TEST(FeltMessages, UnderlineCharactersNotBytes) {
  EXPECT_EQ(faultsOf("print(\"\xC3\xA4\xC3\xB6\", c);"),
            "s.felt:1:13: error: there is no 'c' here\n  print(\"\xC3\xA4\xC3\xB6\", c);\n              ^");
}

TEST(FeltMessages, PlacesAndOffsetsAreTheSame) {
  const Source source("s", "ab\n\xC3\xA9\xC3\xA9x\n\nend");
  for (const int offset : {0, 1, 2, 3, 5, 7, 8, 9, 10, 13})
    EXPECT_EQ(source.offsetOf(source.placeOf(offset)), offset);
  EXPECT_EQ(source.offsetOf({9, 1}), 13);
  EXPECT_EQ(source.offsetOf({4, 99}), 13);
}

TEST(FeltMessages, AreJsonForEditors) {
  try {
    Program("dir/\"s\".felt", "print(c);\nprint(d);", allFunctions());
    FAIL();
  } catch (const ScriptError& error) {
    EXPECT_EQ(
        error.json(),
        "{\"file\": \"dir/\\\"s\\\".felt\", \"line\": 1, \"column\": 7, \"endLine\": 1, \"endColumn\": 8, "
        "\"severity\": \"error\", \"code\": \"unknown-name\", \"message\": \"there is no 'c' here\", "
        "\"hint\": "
        "\"\"}\n"
        "{\"file\": \"dir/\\\"s\\\".felt\", \"line\": 2, \"column\": 7, \"endLine\": 2, \"endColumn\": 8, "
        "\"severity\": \"error\", \"code\": \"unknown-name\", \"message\": \"there is no 'd' here\", "
        "\"hint\": "
        "\"\"}\n");
  }
}

TEST(FeltMessages, LimitsEndWhatHasNoEnd) {
  Context context;
  context.limits = {.statements = 1000, .calls = 10, .elements = 100, .depth = 50};
  EXPECT_NE(faultsOf("while (true) { }", &context).find("carried out 1000 statements"), std::string::npos);
  EXPECT_NE(faultsOf("int[] a; for (int i = 0; true; i++) a[i] = i;", &context).find("100 elements"),
            std::string::npos);
  EXPECT_NE(faultsOf("string s = \"x\"; while (true) s = s + s;", &context).find("100 characters"),
            std::string::npos);
  EXPECT_NE(faultsOf("scalarfield f = perlin(1); while (true) f = f + 1;", &context).find("50 operations"),
            std::string::npos);
  EXPECT_NE(faultsOf("domain d((0,0,0), (1,1,1), 1e-6);")
                .find("a domain may have 2.1e+09 cells at most, not 1e+18"),
            std::string::npos);
}

TEST(FeltMessages, TellWhatNumbersCannotBe) {
  const std::pair<const char*, const char*> cases[] = {
      {"print(abs(-9223372036854775807 - 1));", "the result is no integer of 64 bits"},
      {"print((-1) ^ 0.5);", "-1 to the power 0.5 is no number"},
      {"print(pow(-8, 1.0/3));", "-8 to the power 0.333333 is no number"},
      {"print(0 ^ -1);", "division by zero"},
      {"domain d((0,0,0), (2147483648,1,1), (0,0,0), 1, 1, 1);", "a domain may have 2.1e+09 cells at most"},
  };
  for (const auto& [script, message] : cases)
    EXPECT_NE(faultsOf(script).find(message), std::string::npos) << script << faultsOf(script);
  EXPECT_EQ(printed("print((-2) ^ 3, pow(-2, -1), abs(-3), 0 ^ 0);"), "-8 -0.5 3 1\n");
}

TEST(FeltMessages, AScriptCutOffAnywhereIsRefusedOrRuns) {
  const std::string script =
      "// a cloud\nparam float gain = 1.5e0 in [0, 4] \"how much\";\n"
      "func scalarfield layer(scalarfield l, float a = 2.5) {\n  for (int i = 0; i < 3; i++) { l += a * "
      "perlin(2); }\n"
      "  if (a > 1 && true) return l; else return -l ^ 2;\n}\n"
      "scalarfield[] all = [layer(sphere((0,0,0), 1)), 3];\n/* end */ print(\"done\", eval(all[0], "
      "(1,2,3)));\n";
  for (std::size_t length = 0; length <= script.size(); ++length) {
    const std::string part = script.substr(0, length);
    try {
      printedBy(Program("s.felt", part, allFunctions()));
    } catch (const ScriptError& error) {
      EXPECT_FALSE(std::string(error.what()).empty());
      EXPECT_TRUE(error.isOfScript()) << part;
    }
  }
}

}  // namespace
}  // namespace nephele::felt
