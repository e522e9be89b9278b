#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

// Places are counted in the texts of the scripts; values follow from arithmetic.
class FeltVerb : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.file(name)) << text;
    return folder_.file(name);
  }
  std::string script(const std::string& text) const { return write("script.felt", text); }
  ProgramResult piped(const std::string& arguments, const std::string& text) const {
    return runProgram(arguments, {}, write("input", text));
  }

  TemporaryFolder folder_;
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST_F(FeltVerb, RunsAScriptAndPrintsWhatItPrints) {
  const ProgramResult result =
      runProgram("felt run " + script("print(\"a\", 1 + 2);\nprint((1, 2, 3) * 2);\n"));
  EXPECT_EQ(result.exitCode, 0);
  EXPECT_EQ(result.output, "a 3\n(2, 4, 6)\n");
  EXPECT_EQ(result.errors, "");
}

TEST_F(FeltVerb, ReadsAScriptFromTheStandardInput) {
  const ProgramResult result = piped("felt run -", "print(7);");
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_EQ(result.output, "7\n");
}

TEST_F(FeltVerb, SetsParameters) {
  const std::string path = script(
      "param float gain = 1 in [0, 4] \"how bright\";\nparam string kind = "
      "\"perlin\" in [\"perlin\", \"worley\"];\nprint(gain, kind);\n");
  EXPECT_EQ(runProgram("felt run " + path + " --set gain=2.5 --set kind=worley").output, "2.5 worley\n");
  const ProgramResult unknown = runProgram("felt run --set gian=2 " + path);
  EXPECT_EQ(unknown.exitCode, 2);
  EXPECT_TRUE(contains(unknown.errors, "--set: " + path + " has no parameter 'gian'; did you mean 'gain'?"))
      << unknown.errors;
  const ProgramResult outside = runProgram("felt run " + path + " --set gain=9");
  EXPECT_EQ(outside.exitCode, 2);
  EXPECT_TRUE(contains(outside.errors, "setting gain:1:1: error: 'gain' is 9, and may be from 0 to 4"))
      << outside.errors;
  const ProgramResult noValue = runProgram("felt run " + path + " --set gain");
  EXPECT_EQ(noValue.exitCode, 2);
  EXPECT_TRUE(contains(noValue.errors, "allowed: NAME=VALUE")) << noValue.errors;
}

TEST_F(FeltVerb, TellsWhereAFaultIs) {
  const std::string path = script("scalarfield a = 1;\nscalarfield b = spere((0,0,0), 1);\n");
  const ProgramResult result = runProgram("felt run " + path);
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(result.errors.starts_with(path + ":2:17: error: ")) << result.errors;
  EXPECT_TRUE(contains(result.errors, "did you mean `sphere`?")) << result.errors;
  EXPECT_EQ(result.output, "");
}

TEST_F(FeltVerb, RefusesAScriptThatIsCutOff) {
  const std::string path = script("func float f(float x) {\n  return x +");
  const ProgramResult result = runProgram("felt run " + path);
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.errors, path + ":2:")) << result.errors;
}

TEST_F(FeltVerb, NamesAFileThatIsNotThere) {
  for (const char* action : {"run", "check", "format"}) {
    const std::string path = folder_.file("none.felt");
    const ProgramResult result = runProgram(std::string("felt ") + action + " " + path);
    EXPECT_EQ(result.exitCode, 1);
    EXPECT_EQ(result.errors, "nephele felt: error: " + path + ": cannot be opened for reading\n");
  }
}

TEST_F(FeltVerb, DataAtFaultIsNoFaultOfTheScript) {
  const ProgramResult result = runProgram("felt run " + script("error(\"the wind is too strong\");"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_TRUE(contains(result.errors, "script.felt:1:1: error: the wind is too strong")) << result.errors;
}

TEST_F(FeltVerb, EndsWhatHasNoEnd) {
  const std::string path = script("int i = 0;\nwhile (true) i = i + 1;\n");
  const ProgramResult result = runProgram("felt run " + path + " --max-statements 1000");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.errors, "1000")) << result.errors;
  EXPECT_EQ(runProgram("felt run " + path + " --max-statements 0").exitCode, 2);
}

TEST_F(FeltVerb, ChecksWithoutRunning) {
  const std::string good = script("print(1);\n"), bad = write("bad.felt", "int a = 1.5;\n");
  const ProgramResult result = runProgram("felt check " + good + " " + bad + " --json");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_EQ(result.output, "");
  const nlohmann::json fault = nlohmann::json::parse(result.errors);
  EXPECT_EQ(fault["file"], bad);
  EXPECT_EQ(fault["line"], 1);
  EXPECT_EQ(fault["column"], 9);
  EXPECT_EQ(fault["endColumn"], 12);
  EXPECT_EQ(fault["severity"], "error");
  EXPECT_EQ(fault["code"], "wrong-type");
  EXPECT_EQ(runProgram("felt check " + good).exitCode, 0);
}

TEST_F(FeltVerb, ExplainsFieldsAndCaches) {
  const std::string path = script(
      "param float gain = 2 in [0, 4] \"how bright\";\n"
      "scalarfield density = gain * mask(sphere((0,0,0), 1));\n"
      "scalarcache held(domain((0,0,0), (1,2,1), 0.25));\n");
  const ProgramResult result =
      runProgram("felt run " + path + " --explain --stats " + folder_.file("stats.json"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_TRUE(contains(result.output, "param float gain = 2 in [0, 4]: how bright\n")) << result.output;
  EXPECT_TRUE(contains(result.output, "held: scalarcache of 4 x 8 x 4 cells")) << result.output;
  EXPECT_TRUE(contains(result.output, "between (0, 0, 0) and (1, 2, 1)")) << result.output;
  const nlohmann::json stats = nlohmann::json::parse(textOf(folder_.file("stats.json")));
  ASSERT_EQ(stats["fields"].size(), 1u);
  // A sphere, its mask, the gain and the product.
  EXPECT_EQ(stats["fields"][0]["operations"], 4);
  EXPECT_GT(stats["fields"][0]["nanoseconds_per_point"].get<double>(), 0.0);
  EXPECT_EQ(stats["caches"][0]["cells"], (nlohmann::json{4, 8, 4}));
}

TEST_F(FeltVerb, FormatsInPlaceAndOnlyOnce) {
  const std::string path = script("float   a=3;   // three\nif(a>2){print(a);}\n");
  EXPECT_EQ(runProgram("felt format " + path + " --check").exitCode, 1);
  const ProgramResult shown = runProgram("felt format " + path + " --stdout");
  EXPECT_EQ(shown.exitCode, 0) << shown.errors;
  EXPECT_EQ(textOf(path), "float   a=3;   // three\nif(a>2){print(a);}\n");
  EXPECT_EQ(runProgram("felt format " + path).exitCode, 0);
  EXPECT_EQ(textOf(path), shown.output);
  EXPECT_EQ(runProgram("felt format " + path + " --check").exitCode, 0);
  EXPECT_EQ(runProgram("felt format " + path).output, "");
  EXPECT_EQ(piped("felt format -", "float   a=3;").output, "float a = 3;\n");
}

TEST_F(FeltVerb, FormatsNothingThatDoesNotClose) {
  const std::string path = script("print(\"a);\n");
  EXPECT_EQ(runProgram("felt format " + path).exitCode, 2);
  EXPECT_EQ(textOf(path), "print(\"a);\n");
}

TEST_F(FeltVerb, FindsFunctionsByWords) {
  const ProgramResult found = runProgram("felt functions divergence");
  EXPECT_EQ(found.exitCode, 0);
  EXPECT_TRUE(contains(found.output, "vectorfield curlnoise(")) << found.output;
  EXPECT_TRUE(contains(found.output, "e.g. ")) << found.output;
  EXPECT_FALSE(contains(found.output, "operator"));
  const ProgramResult near = runProgram("felt functions shpere");
  EXPECT_EQ(near.exitCode, 1);
  EXPECT_TRUE(contains(near.errors, "did you mean 'sphere'?")) << near.errors;
}

TEST_F(FeltVerb, RefusesOptionsOfOtherActions) {
  const ProgramResult result = runProgram("felt check " + script("print(1);") + " --explain");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.errors, "--explain: goes with run only")) << result.errors;
  EXPECT_EQ(runProgram("felt").exitCode, 2);
  EXPECT_EQ(runProgram("felt run").exitCode, 2);
  EXPECT_EQ(runProgram("felt run a.felt b.felt").exitCode, 2);
  EXPECT_EQ(runProgram("felt dance").exitCode, 2);
}

TEST_F(FeltVerb, GivesScriptsTheNamesThatRenderGivesThem) {
  const std::string path = script("scalarfield f = P.x;\nprint(time, seed, eval(f, (3, 0, 0)));\n");
  EXPECT_EQ(runProgram("felt run " + path).output, "0 0 3\n");
  EXPECT_EQ(runProgram("felt check " + path).exitCode, 0);
}

TEST_F(FeltVerb, AnswersLineByLine) {
  const ProgramResult result =
      piped("felt repl",
            "float a = 2\n1 + 2 * a\nfunc float twice(float x) {\n  return 2 * x;\n}\n"
            "twice(a);\ntwice(a)\n\"a = b\"\na == 2\n[1, 2]\nsphere((0,0,0), 1)\n:names\n:quit\n7\n");
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_EQ(result.output,
            "5 : float\n4 : float\na = b : string\ntrue : bool\n[1, 2] : int[]\na scalarfield\n"
            "P = a vectorfield\ntime = 0 : float\nseed = 0 : int\na = 2 : float\n")
      << result.errors;
}

TEST_F(FeltVerb, GoesOnAfterAFaultInALine) {
  const ProgramResult result = piped("felt repl", "spere((0,0,0), 1)\n:dance\n:plot 1\n1 + 1\n");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_EQ(result.output, "2 : int\n");
  EXPECT_TRUE(contains(result.errors, "line 1:1:1: error: there is no function 'spere'")) << result.errors;
  EXPECT_TRUE(contains(result.errors, "there is no command ':dance'")) << result.errors;
  // Lines are those that were read, whatever the prompt had to look up between them.
  const ProgramResult later = piped("felt repl", "float a = 1\n:names\n[1,\n 2]\nspere(a)\n");
  EXPECT_TRUE(contains(later.errors, "line 5:1:1: error")) << later.errors;
  EXPECT_TRUE(contains(result.errors, ":plot FIELD from (x, y, z) to (x, y, z)")) << result.errors;
}

TEST_F(FeltVerb, PlotsAFieldAlongALine) {
  const ProgramResult result = piped("felt repl", ":plot P.x from (-1, 0, 0) to (3, 0, 0)\n");
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  // Twelve lines of letters, and one that names the ends; the curve rises from -1 to 3.
  EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 13) << result.output;
  EXPECT_TRUE(result.output.starts_with("         3 ")) << result.output;
  EXPECT_TRUE(contains(result.output, "\n        -1 ")) << result.output;
  EXPECT_TRUE(contains(result.output, "(-1, 0, 0)")) << result.output;
}

TEST_F(FeltVerb, SlicesAFieldAsTextAndAsAPicture) {
  const std::string picture = folder_.file("slice.png");
  const ProgramResult result =
      piped("felt repl", "scalarfield ball = sphere((0,0,0), 1)\n:slice ball z=0\n:slice ball x=0.5 " +
                             picture + " from (-2, -1, -1) to (2, 1, 1)\n");
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_TRUE(contains(result.output, "z = 0, x to the right, y up")) << result.output;
  EXPECT_TRUE(contains(result.output, "@")) << result.output;
  // The box is as wide in z as it is high in y.
  const ProgramResult info = runProgram("info " + picture);
  EXPECT_TRUE(contains(info.output, "512")) << info.output << info.errors;
}

TEST_F(FeltVerb, PicturesMayHaveBlanksInTheirNames) {
  const std::string picture = folder_.file("a slice.png");
  const ProgramResult result =
      piped("felt repl", ":slice P.x - P.y z=0 \"" + picture + "\" from (-1, -1, -1) to (1, 1, 1)\n");
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_EQ(runProgram("info '" + picture + "'").exitCode, 0);
}

TEST_F(FeltVerb, TellsFaultsOfScriptsFromThoseOfFiles) {
  const struct {
    const char* script;
    int exitCode;
  } cases[] = {{"scalarfield f = sphere((0,0,0), -1);", 2},
               {"scalarfield f = noise(\"foo\");", 2},
               {"scalarfield f = smoothstep(1, 0, P.x);", 2},
               {"domain d((0,0,0), (1,1,1), 0);", 2},
               {"import \"nowhere.felt\";", 1},
               {"scalarfield f = readfield(\"no.vdb\");", 1},
               {"scalarfield f = mask(P.x, 0);", 2}};
  for (const auto& c : cases) {
    const std::string path = folder_.file("fault.felt");
    std::ofstream(path) << c.script << "\n";
    EXPECT_EQ(runProgram("felt run " + path).exitCode, c.exitCode) << c.script;
  }
}

TEST_F(FeltVerb, RunsTheFiguresOfTheNotes) {
  for (const char* name : {"slab", "spheres"}) {
    const ProgramResult result =
        runProgram("felt run " + ownData("data/felt/figures/") + name + ".felt --set steps=2");
    EXPECT_EQ(result.exitCode, 0) << result.errors;
  }
}

TEST_F(FeltVerb, RunsTheScriptsOfTheProject) {
  for (const auto& entry : std::filesystem::recursive_directory_iterator(ownData("data/felt"))) {
    if (entry.path().extension() != ".felt") continue;
    const std::string path = entry.path().string();
    const ProgramResult checked = runProgram("felt check " + path);
    EXPECT_EQ(checked.exitCode, 0) << checked.errors;
    EXPECT_EQ(checked.errors, "");
    const ProgramResult result = runProgram("felt format --check " + path);
    EXPECT_EQ(result.exitCode, 0) << result.errors;
  }
}

}  // namespace
}  // namespace nephele::test
