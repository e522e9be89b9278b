// Every kind of message about a recipe or a file of options, exactly.
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

struct Pair {
  std::string file, message;
};

/// What `nephele cloud` says of a file that is given to `option`, with the file called a.toml.
std::string messageOf(const std::string& option, const std::string& toml) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("a.toml"), std::ios::binary) << toml;
  const ProgramResult result = runProgram("cloud " + ownData("data/sphere_uv.obj") + " -o " +
                                          folder.file("a.vdb") + " " + option + " " + folder.file("a.toml"));
  EXPECT_EQ(result.exitCode, 2) << toml << result.errors;
  EXPECT_EQ(folder.entryCount(), 1u);
  std::string text = result.errors;
  const std::string path = folder.file("a.toml");
  for (std::size_t at; (at = text.find(path)) != text.npos;) text.replace(at, path.size(), "a.toml");
  return text;
}

void expectMessages(const std::string& option, const std::vector<Pair>& pairs) {
  for (const Pair& pair : pairs) EXPECT_EQ(messageOf(option, pair.file), pair.message + '\n') << pair.file;
}

TEST(TomlMessages, OfTheTextAreExactlyThese) {
  const std::vector<Pair> pairs{
      {"a = 1\nb 2\n",
       "a.toml:2:3: error: key-value pair: expected '=', saw '2'\n"
       "  b 2\n"
       "    ^"},
      // Columns are letters, not bytes; the mark of UTF-8 is none.
      {"\xEF\xBB\xBF'\u00e9\u00e9' = \"\\q\"\n",
       "a.toml:1:10: error: string: unknown escape sequence '\\q'\n"
       "  '\u00e9\u00e9' = \"\\q\"\n"
       "           ^"},
      {"seed = 1\nseed = 2\n",
       "a.toml:2:8: error: key-value pair: cannot redefine existing integer 'seed'\n"
       "  seed = 2\n"
       "         ^"},
  };
  expectMessages("--recipe", pairs);
  expectMessages("--config", pairs);
  std::string deep = "a";
  for (int i = 0; i != 40; ++i) deep += ".a";
  expectMessages("--config", {{"# fine.....\n'a.b' = 1\n" + deep + " = 1\n",
                               "a.toml:3:64: error: a key nests more than 32 deep\n  " + deep + " = 1\n  " +
                                   std::string(63, ' ') + "^"}});
}

TEST(TomlMessages, OfRecipesAreExactlyThese) {
  expectMessages(
      "--recipe",
      {{"[[layer]]\n  frequncy = 3\n",
        "a.toml:2:3: error: 'frequncy' is not a key of a layer\n"
        "    frequncy = 3\n"
        "    ^~~~~~~~\n"
        "  hint: did you mean `frequency`?"},
       {"[[layer]]\ncolour = 3\n",
        "a.toml:2:1: error: 'colour' is not a key of a layer\n"
        "  colour = 3\n"
        "  ^~~~~~\n"
        "  hint: keys: noise, octaves, octave_lacunarity, octave_roughness, spectrum, time, period, seed, "
        "amplitude, frequency, billow, billow_scale, mask, direction, bias"},
       {"[[layers]]\n",
        "a.toml:1:3: error: 'layers' is not a key of a recipe\n"
        "  [[layers]]\n"
        "    ^~~~~~\n"
        "  hint: did you mean `layer`?"},
       {"layer = 3\n",
        "a.toml:1:9: error: 'layer' is a list of tables, each below a line [[layer]]\n"
        "  layer = 3\n"
        "          ^"},
       {"[[layer]]\namplitude = true # high\n",
        "a.toml:2:13: error: 'amplitude' takes a text or a number\n"
        "  amplitude = true # high\n"
        "              ^~~~"},
       {"[[layer]]\namplitude = \"-1%\"\n",
        "a.toml:2:13: error: amplitude: got '-1%', allowed: a length >= 0 in world units (0.3) or percent of "
        "the longest side (5%)\n"
        "  amplitude = \"-1%\"\n"
        "              ^~~~~"},
       {"[[layer]]\nmask = \"height:0=0,1=2\"\n",
        "a.toml:2:8: error: mask: got 'height:0=0,1=2', allowed: in place of '2' a number from 0 to 1\n"
        "  mask = \"height:0=0,1=2\"\n"
        "         ^~~~~~~~~~~~~~~~"},
       {"[[layer]]\noctaves = 17\n",
        "a.toml:2:11: error: 'octaves' takes a whole number from 1 to 16\n"
        "  octaves = 17\n"
        "            ^~"},
       {"[[layer]]\ntime = 1e7\n",
        "a.toml:2:8: error: 'time' takes a number from -1e+06 to 1e+06\n"
        "  time = 1e7\n"
        "         ^~~"},
       {"[[layer]]\nnoise = \"perln\"\n",
        "a.toml:2:9: error: noise: got 'perln', allowed: one of perlin, simplex, worley, worley_difference, "
        "value, gabor, fft\n"
        "  noise = \"perln\"\n"
        "          ^~~~~~~"},
       {"[[layer]]\ndirection = [0,\n  0, 0]\n",
        "a.toml:2:13: error: 'direction' takes a direction [X, Y, Z] that is not 0\n"
        "  direction = [0,\n"
        "              ^~~"},
       {"[[layer]]\nbias = 0.5\n",
        "a.toml:2:1: error: 'bias' needs 'direction' beside it\n"
        "  bias = 0.5\n"
        "  ^~~~"},
       {"[[layer]]\nspectrum = 3\n",
        "a.toml:2:12: error: 'spectrum' takes a table: { exponent = 3.67, lowest = 0.5, highest = 4 }\n"
        "  spectrum = 3\n"
        "             ^"}});
  std::string many;
  for (int i = 0; i != 17; ++i) many += "[[layer]]\n";
  EXPECT_EQ(messageOf("--recipe", many),
            "a.toml:17:1: error: there are 17 layers, allowed: 1 to 16\n  [[layer]]\n  ^~~~~~~~~\n");
  EXPECT_EQ(messageOf("--recipe", "# nothing\n"),
            "a.toml:1:1: error: there is no layer\n  # nothing\n  ^\n  hint: each begins with a line "
            "[[layer]]\n");
  EXPECT_EQ(messageOf("--recipe", ""),
            "a.toml:1:1: error: there is no layer\n  \n  ^\n  hint: each begins with a line [[layer]]\n");
}

TEST(TomlMessages, OfExpressionsPointIntoTheLineOfTheFile) {
  expectMessages("--recipe", {{"[[layer]]\namplitude = \"=2% * sphre(P)\" # \u00e9\n",
                               "a.toml:2:20: error: there is no function 'sphre'\n"
                               "  amplitude = \"=2% * sphre(P)\" # \u00e9\n"
                               "                     ^~~~~\n"
                               "  hint: did you mean `sphere`?"},
                              {"[[layer]]\nbillow = '=1 +'\n",
                               "a.toml:2:15: error: expected a value, found the end of the text\n"
                               "  billow = '=1 +'\n"
                               "                ^"},
                              // Behind escapes of one, two and no bytes, and over lines.
                              {"[[layer]]\nbillow = \"=\\t\\u0031 + \\u00e9\"\n",
                               "a.toml:2:23: error: '\u00e9' means nothing here\n"
                               "  billow = \"=\\t\\u0031 + \\u00e9\"\n"
                               "                        ^~~~~~"},
                              {"[[layer]]\nbillow = \"\"\"\n=1 + \\\n   prlin(2)\"\"\"\n",
                               "a.toml:4:4: error: there is no function 'prlin'\n"
                               "     prlin(2)\"\"\"\n"
                               "     ^~~~~\n"
                               "  hint: did you mean `perlin`?"},
                              {"[[layer]]\nbillow = '''\n=1 +\n  prlin(2)'''\n",
                               "a.toml:4:3: error: there is no function 'prlin'\n"
                               "    prlin(2)'''\n"
                               "    ^~~~~\n"
                               "  hint: did you mean `perlin`?"},
                              {"[[layer]]\nbillow = '=1'\n[[layer]]\namplitude = '=(1, 2, 3)'\n",
                               "a.toml:4:15: error: the expression is a scalarfield, and this is a vector\n"
                               "  amplitude = '=(1, 2, 3)'\n"
                               "                ^~~~~~~~~"}});
  expectMessages("--config", {{"layers = 2\n[cloud]\nbillow = \"=1 * prlin(3)\"\n",
                               "a.toml:3:16: error: there is no function 'prlin'\n"
                               "  billow = \"=1 * prlin(3)\"\n"
                               "                 ^~~~~\n"
                               "  hint: did you mean `perlin`?"}});
}

TEST(TomlMessages, OfOptionsAreExactlyThese) {
  expectMessages("--config",
                 {{"resolutoin = 24\n",
                   "a.toml:1:1: error: 'resolutoin' is not an option of this verb\n"
                   "  resolutoin = 24\n"
                   "  ^~~~~~~~~~\n"
                   "  hint: did you mean `resolution`?"},
                  {"[clouds]\nbillow = 1\n",
                   "a.toml:1:2: error: 'clouds' is neither an option nor a verb\n"
                   "  [clouds]\n"
                   "   ^~~~~~\n"
                   "  hint: did you mean `cloud`?"},
                  {"layers = true\n",
                   "a.toml:1:10: error: 'layers' takes a value, not true or false\n"
                   "  layers = true\n"
                   "           ^~~~"},
                  {"quiet = 3\n",
                   "a.toml:1:9: error: 'quiet' is true or false\n"
                   "  quiet = 3\n"
                   "          ^"},
                  {"layers = 2020-01-01\n",
                   "a.toml:1:10: error: 'layers' must be a text, a number, true, false or an array\n"
                   "  layers = 2020-01-01\n"
                   "           ^~~~~~~~~~"},
                  {"resolution = 0\n",
                   "a.toml:1:14: error: resolution: got '0', allowed: a whole number from 1 to 1000000\n"
                   "  resolution = 0\n"
                   "               ^"}});
}

TEST(TomlMessages, AllFaultsOfAFileAreToldAtOnce) {
  EXPECT_EQ(messageOf("--recipe",
                      "[[layer]]\nspectrum = { exponnt = 3, tile = 0 }\nsede = 1\n[[layer]]\nseed = 'x'\n"),
            "a.toml:2:14: error: 'exponnt' is not a key of a spectrum\n"
            "  spectrum = { exponnt = 3, tile = 0 }\n"
            "               ^~~~~~~\n"
            "  hint: did you mean `exponent`?\n"
            "a.toml:2:34: error: 'tile' takes a number from 1e-06 to 1e+06\n"
            "  spectrum = { exponnt = 3, tile = 0 }\n"
            "                                   ^\n"
            "a.toml:3:1: error: 'sede' is not a key of a layer\n"
            "  sede = 1\n"
            "  ^~~~\n"
            "  hint: did you mean `seed`?\n"
            "a.toml:5:8: error: 'seed' takes a whole number from 0 to 1073741824\n"
            "  seed = 'x'\n"
            "         ^~~\n");
  EXPECT_EQ(messageOf("--config", "layers = 99\nnoise = [\"perlin\", \"perln\"]\n[cloud]\nbillow = -1\n"),
            "a.toml:1:10: error: layers: got '99', allowed: a whole number from 0 to 16\n"
            "  layers = 99\n"
            "           ^~\n"
            "a.toml:2:20: error: noise: got 'perln', allowed: one of "
            "perlin|simplex|worley|worley_difference|value|gabor|fft\n"
            "  noise = [\"perlin\", \"perln\"]\n"
            "                     ^~~~~~~\n"
            "a.toml:4:10: error: billow: got '-1', allowed: a number from 0 to 100\n"
            "  billow = -1\n"
            "           ^~\n");
}

// What an expression is shows only when it is evaluated, and is shown in the file all the same.
TEST(TomlMessages, OfARunShowTheFile) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.toml");
  std::string option = "--recipe ";
  const auto messageOfRun = [&](const std::string& toml, int exitCode, const std::string& others = "") {
    std::ofstream(path) << toml;
    const ProgramResult result =
        runProgram("cloud " + ownData("data/sphere_uv.obj") + " --resolution 24 -o " + folder.file("a.vdb") +
                   " " + option + path + others);
    EXPECT_EQ(result.exitCode, exitCode) << result.errors;
    return result.errors;
  };
  EXPECT_EQ(messageOfRun("[[layer]]\n[[layer]]\nbillow = '=1/(1 - 1)'\n", 2),
            path + ":3:12: error: division by zero\n  billow = '=1/(1 - 1)'\n             ^~~~~~~~~\n");
  EXPECT_EQ(messageOfRun("[[layer]]\nbillow = '=height - 2'\n", 2),
            path +
                ":2:10: error: this may be from -2 to -1, allowed: a number from 0 to 100\n"
                "  billow = '=height - 2'\n"
                "           ^~~~~~~~~~~~~\n"
                "  hint: clamp(..., LOW, HIGH) keeps it within\n");
  EXPECT_EQ(
      messageOfRun("[[layer]]\n[[layer]]\namplitude = \"attribute:growth:0,1%\"\n", 1),
      path +
          ":3:13: error: the mesh has no vertex attribute 'growth'; it has none (per corner, which will not "
          "do: uv)\n"
          "  amplitude = \"attribute:growth:0,1%\"\n"
          "              ^~~~~~~~~~~~~~~~~~~~~~~\n");
  EXPECT_EQ(messageOfRun("[[layer]]\nspectrum = { exponent = 3 }\n", 2),
            path +
                ":2:12: error: only noise = \"fft\" has a spectrum, not \"perlin\"\n"
                "  spectrum = { exponent = 3 }\n"
                "             ^~~~~~~~~~~~~~~~\n");

  option = "--config ";
  EXPECT_EQ(messageOfRun("layers = 2\n[cloud]\nbillow = '=1/(1 - 1)'\n", 2),
            path + ":3:12: error: division by zero\n  billow = '=1/(1 - 1)'\n             ^~~~~~~~~\n");
  // The file is looked for where the expression is evaluated.
  const std::string missing = messageOfRun("amplitude = '=0.1 * readfield(\"missing.vdb\")'\n", 1);
  EXPECT_TRUE(missing.starts_with(path + ":1:21: error: missing.vdb: no such file")) << missing;
  EXPECT_EQ(messageOfRun("billow = '=height - 2'\n", 1),
            path +
                ":1:10: error: billow: '=height - 2' may be from -2 to -1, allowed: a number from 0 to 100; "
                "clamp(..., LOW, HIGH) keeps it within\n"
                "  billow = '=height - 2'\n"
                "           ^~~~~~~~~~~~~\n");
  EXPECT_EQ(
      messageOfRun("amplitude = \"attribute:growth:0,1%\"\n", 1),
      path +
          ":1:13: error: amplitude: the mesh has no vertex attribute 'growth'; it has none (per corner, "
          "which will not do: uv)\n"
          "  amplitude = \"attribute:growth:0,1%\"\n"
          "              ^~~~~~~~~~~~~~~~~~~~~~~\n");
  // What is typed is shown as it was typed.
  EXPECT_TRUE(
      messageOfRun("billow = '=0.5'\n", 2, " --billow '=1/(2 - 2)'").starts_with("--billow:1:1: error"));
  // In a frame of a sequence, too.
  std::ofstream(path) << "billow = '=1/(1 - 1)'\n";
  const ProgramResult frames = runProgram("cloud " + ownData("data/sphere_uv.obj") + " --resolution 24 -o " +
                                          folder.file("a.##.vdb") + " --frames 1-2 --config " + path);
  EXPECT_NE(frames.errors.find(path + ":1:12: error: division by zero"), std::string::npos) << frames.errors;
}

}  // namespace
}  // namespace nephele::test
