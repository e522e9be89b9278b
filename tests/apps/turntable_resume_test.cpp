// The verb turntable where work is shared, stopped and taken up again, through the program.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "nephele/render/image/exr_io.h"
#include "tests/apps/turntable_verb.h"
#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;

TEST_F(TurntableVerb, SkipsWholeFramesAndMakesDamagedOnesAgain) {
  ASSERT_EQ(runProgram(call("--frames 1-6")).exitCode, 0);
  const Image truth = readImage(frame(2));
  // 1 stays. 2 loses its end; 3 is damaged in the middle; 4 is empty; 5 is of another size; 6 is not there.
  fs::resize_file(frame(2), fs::file_size(frame(2)) - 40);
  {
    std::fstream file(frame(3), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(std::streamoff(fs::file_size(frame(3)) * 2 / 3));
    file << std::string(200, '\xaa');
  }
  fs::resize_file(frame(4), 0);
  fs::copy_file(frame(1), frame(5), fs::copy_options::overwrite_existing);
  ASSERT_EQ(runProgram("render " + volume("club.vdb") + " -o '" + frame(5) + "' --size 32x18").exitCode, 0);
  fs::remove(frame(6));
  const auto before = fs::last_write_time(frame(1));

  const ProgramResult result =
      runProgram(call("--frames 1-6 --skip-existing --stats '" + folder.file("s.json") + "'"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_EQ(fs::last_write_time(frame(1)), before);
  const auto stats = statistics();
  for (std::size_t i = 0; i != 6; ++i) EXPECT_EQ(stats["frames"][i]["skipped"], i == 0) << i;
  for (int number = 1; number <= 6; ++number) {
    ASSERT_TRUE(isWhole(frame(number))) << number;
    EXPECT_EQ(readImage(frame(number)).width, 64);
  }
  EXPECT_EQ(readImage(frame(2)).channel("G").values, truth.channel("G").values);
  // Each of them is named; the one that is missing is no surprise.
  for (int number = 2; number <= 5; ++number)
    EXPECT_NE(result.errors.find(fs::path(frame(number)).filename().string()), std::string::npos)
        << result.errors;
  EXPECT_EQ(result.errors.find("f.0006"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("32x18 and not 64x36"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("skipping 1 of 6"), std::string::npos) << result.errors;
}

TEST_F(TurntableVerb, SkipsWithoutMakingLightAndAddsMissingPreviews) {
  const std::string preview =
      " --preview '" + folder.file("v.#.png") + "' --stats '" + folder.file("s.json") + "'";
  ASSERT_EQ(runProgram(call("--frames 1-3" + preview)).exitCode, 0);
  const std::string second = textOf(folder.file("v.2.png"));
  fs::remove(folder.file("v.2.png"));
  ASSERT_EQ(runProgram(call("--frames 1-3 --skip-existing" + preview)).exitCode, 0);
  EXPECT_TRUE(isWhole(folder.file("v.2.png")));
  EXPECT_EQ(statistics()["light_seconds"], 0.0);
  EXPECT_EQ(statistics()["rays"], 0);
}

TEST_F(TurntableVerb, ShowsFramesThatWereThereAsOneCallDoes) {
  const auto sheet = [&](const std::string& name, const std::string& options) {
    const ProgramResult result = runProgram(call("--frames 1-2 --stats '" + folder.file("s.json") +
                                                 "' --contact-sheet '" + folder.file(name) + "' " + options));
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return readImage(folder.file(name)).channel("B").values;
  };
  const auto one = sheet("one.png", ""), black = sheet("black.png", "--background 0,0,0");
  // Frames without a backdrop, then with one.
  for (const std::string& made : {std::string(), " --contact-sheet '" + folder.file("c.png") + "'"}) {
    ASSERT_EQ(runProgram(call("--frames 1-2" + made)).exitCode, 0);
    EXPECT_EQ(sheet("more.png", "--skip-existing"), one);
    EXPECT_EQ(statistics()["frames"][0]["skipped"], true);
    EXPECT_EQ(sheet("more.png", "--skip-existing --background 0,0,0"), black);
  }
}

TEST_F(TurntableVerb, MakesPreviewsAgainThatAreShownInAnotherWay) {
  const std::string path = folder.file("v.1.png"),
                    start = "--frames 1 --skip-existing --preview '" + folder.file("v.#.png") + "' ";
  const auto preview = [&](const std::string& options) {
    const ProgramResult result = runProgram(call(start + options));
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return readImage(path).channel("G").values;
  };
  const auto first = preview("");
  const auto before = fs::last_write_time(path);
  EXPECT_EQ(preview(""), first);
  EXPECT_EQ(fs::last_write_time(path), before);
  for (const char* options : {"--exposure 1", "--view-transform agx", "--background 1,0,0"})
    EXPECT_NE(preview(options), first) << options;
}

TEST_F(TurntableVerb, SkipsOnlyWhatWasMadeWithTheSameOptionsOfTheSameInput) {
  const std::string input = folder.file("in.vdb");
  fs::copy_file(data_->file("club.vdb"), input);
  const auto skipped = [&](const std::string& options) {
    const ProgramResult result = runProgram(
        fmt::format("turntable '{}' -o '{}' --size 16x12 --samples 1 --skip-existing --stats '{}' {}", input,
                    folder.file("f.####.exr"), folder.file("s.json"), options));
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    int count = 0;
    const auto stats = statistics();
    for (const auto& entry : stats["frames"]) count += entry["skipped"] == true;
    if (count == 0 && fs::exists(folder.file("once"))) {
      EXPECT_NE(result.errors.find("other options"), std::string::npos) << options << result.errors;
    }
    std::ofstream(folder.file("once")) << "x";
    return count;
  };
  EXPECT_EQ(skipped("--frames 1-3"), 0);
  // What says where files go, how many frames are made and by how many threads does not count.
  EXPECT_EQ(skipped("--frames 1-3 --threads 1 --exposure 1 --preview '" + folder.file("v.#.png") + "'"), 3);
  EXPECT_EQ(skipped("--frames 1-3x2"), 2);
  EXPECT_EQ(skipped("--frames 1-3 --only 2"), 1);
  EXPECT_EQ(skipped("--frames 1-3 --sun 10,20"), 0);
  EXPECT_EQ(skipped("--frames 1-3 --sun 10,20"), 3);
  // The picture of another frame.
  fs::copy_file(frame(3), frame(2), fs::copy_options::overwrite_existing);
  EXPECT_EQ(skipped("--frames 1-3 --sun 10,20"), 2);
  // A turn of other frames has them elsewhere.
  EXPECT_EQ(skipped("--frames 1-4 --only 1-3 --sun 10,20"), 0);
  EXPECT_EQ(skipped("--frames 1-4 --only 1-3 --sun 10,20"), 3);
  // The same file elsewhere is the same; another of its name is not.
  const std::string other = folder.file("other.vdb");
  fs::rename(input, other);
  fs::copy_file(other, input);
  EXPECT_EQ(skipped("--frames 1-4 --only 1-3 --sun 10,20"), 3);
  fs::copy_file(data_->file("ball.vdb"), input, fs::copy_options::overwrite_existing);
  EXPECT_EQ(skipped("--frames 1-4 --only 1-3 --sun 10,20"), 0);
}

TEST_F(TurntableVerb, ShardsTogetherMakeAllFrames) {
  for (int shard = 1; shard <= 3; ++shard) {
    const ProgramResult result = runProgram(call("--frames 1-7 --shard " + std::to_string(shard) + "/3"));
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    // 1 4 7, then 2 5, then 3 6.
    EXPECT_EQ(files().size(), shard == 1 ? 3u : shard == 2 ? 5u : 7u);
  }
  EXPECT_EQ(runProgram(call("--frames 1-2 --shard 3/3")).exitCode, 0);
  // The end of the work: a call with all frames there.
  const ProgramResult result =
      runProgram(call("--frames 1-7 --skip-existing --contact-sheet '" + folder.file("c.png") + "'"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.errors.find("skipping 7 of 7"), std::string::npos) << result.errors;
  EXPECT_TRUE(isWhole(folder.file("c.png")));
}

TEST_F(TurntableVerb, FailsAtOnceWhereItCannotWrite) {
  std::ofstream(folder.file("file")) << "x";
  const ProgramResult result = runProgram("turntable " + volume("ball.vdb") + " -o '" +
                                          folder.file("file/f.####.exr") + "' --frames 1-4");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("f.0001.exr"), std::string::npos) << result.errors;
}

TEST_F(TurntableVerb, KeepsEarlierFramesWhenAFileCannotBeWritten) {
  // A limit on the size of files stands for a full disk: the club seen from its end makes small files, from
  // its side large ones.
  ASSERT_EQ(runProgram(call("--frames 1-8 --view 180,0 --aov none")).exitCode, 0);
  std::vector<std::uintmax_t> sizes;
  for (int i = 1; i <= 8; ++i) sizes.push_back(fs::file_size(frame(i)));
  // In units of 512 bytes: enough for the first frame.
  const std::uintmax_t limit = sizes[0] / 512 + 1;
  int first = 0;
  while (first != 8 && sizes[std::size_t(first)] <= limit * 512) ++first;
  ASSERT_LT(first, 8) << "all frames have the same size";
  for (int i = 1; i <= 8; ++i) fs::remove(frame(i));
  const ProgramResult result =
      runProgram(call("--frames 1-8 --view 180,0 --aov none"), "ulimit -f " + std::to_string(limit) + ";");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find(fs::path(frame(first + 1)).filename().string()), std::string::npos)
      << result.errors;
  EXPECT_EQ(int(files().size()), first);
  for (int i = 1; i <= first; ++i) EXPECT_TRUE(isWhole(frame(i)));
}

TEST_F(TurntableVerb, EndsCleanlyOnSignalsAndResumes) {
  for (const auto& [signal, code] : {std::pair{"INT", 130}, {"TERM", 143}, {"KILL", 137}}) {
    // Sent once the second frame is there; the whole would take minutes.
    std::ofstream(folder.file("script"))
        << "'" << programPath() << "' " << call("--frames 1-2000", "club.vdb", 64) << " 2>'"
        << folder.file("err") << "' >/dev/null &\nid=$!\nwhile [ ! -e '" << frame(2)
        << "' ] && kill -0 $id; do sleep 0.02; done\nkill -" << signal << " $id\nwait $id\n";
    const int status = std::system(("sh '" + folder.file("script") + "' 2>/dev/null").c_str());
    fs::remove(folder.file("script"));
    EXPECT_EQ(WEXITSTATUS(status), code) << signal;
    if (code != 137) {
      EXPECT_NE(textOf(folder.file("err")).find("--skip-existing makes the rest"), std::string::npos)
          << textOf(folder.file("err"));
    }
    fs::remove(folder.file("err"));
    int count = 0;
    for (const std::string& name : files()) {
      // Killed without a chance, it may leave the hidden file that it was writing.
      if (code == 137 && name.starts_with('.')) continue;
      EXPECT_TRUE(isWhole(folder.file(name))) << name;
      ++count;
    }
    EXPECT_GE(count, 2);

    const ProgramResult rest =
        runProgram(call("--frames 1-2000 --skip-existing --only 1-" + std::to_string(count + 2) +
                            " --stats '" + folder.file("s.json") + "'",
                        "club.vdb", 64));
    EXPECT_EQ(rest.exitCode, 0) << rest.errors;
    int skipped = 0;
    const auto stats = statistics();
    for (const auto& entry : stats["frames"]) skipped += entry["skipped"] == true;
    EXPECT_EQ(skipped, count);
    for (int i = 1; i <= count + 2; ++i) {
      EXPECT_TRUE(isWhole(frame(i)));
      fs::remove(frame(i));
    }
    fs::remove(folder.file("s.json"));
  }
}

TEST_F(TurntableVerb, TellsFarmsHowFarItIs) {
  const ProgramResult result = runProgram(call("--frames 1-40 --progress alf", "club.vdb", 16));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  std::istringstream lines(result.output);
  int last = -1, count = 0;
  for (std::string line; std::getline(lines, line);) {
    int percent = 0;
    if (std::sscanf(line.c_str(), "ALF_PROGRESS %d%%", &percent) != 1) continue;
    EXPECT_GT(percent, last);
    last = percent;
    ++count;
  }
  EXPECT_EQ(last, 100);
  EXPECT_GE(count, 2);
}

}  // namespace
}  // namespace nephele::test
