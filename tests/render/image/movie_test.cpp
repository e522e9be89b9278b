#include "nephele/render/image/movie.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "nephele/modeling/base/error.h"
#include "tests/support/run_program.h"

namespace nephele {
namespace {

bool isInstalled(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null 2>&1").c_str()) == 0;
}

// What ffprobe says of the stream of a movie, as name=value lines.
std::string probed(const std::string& path) {
  const test::TemporaryFolder folder;
  const std::string command =
      "ffprobe -v error -count_frames -show_streams '" + path + "' >'" + folder.file("o") + "'";
  return std::system(command.c_str()) == 0 ? test::textOf(folder.file("o")) : "";
}

Image grey(int width, int height, float value) {
  Image image;
  image.width = width;
  image.height = height;
  for (const char* name : {"R", "G", "B", "A"})
    for (float& v : image.add(name).values) v = name[0] == 'A' ? 1.0f : value;
  return image;
}

// Why movies cannot be tried here, or null.
const char* whatIsMissing() {
  return isInstalled("ffmpeg") && isInstalled("ffprobe") ? nullptr : "the package ffmpeg is not installed";
}

TEST(Movie, IsH264ForEveryPlayerWithItsColoursNamed) {
  if (const char* missing = whatIsMissing()) GTEST_SKIP() << missing;
  const test::TemporaryFolder folder;
  MovieWriter movie(folder.file("a.mp4"), 64, 36, {.framesPerSecond = 12});
  for (int i = 0; i != 6; ++i) movie.add(grey(64, 36, 0.1f * float(i)), {});
  EXPECT_FALSE(std::filesystem::exists(folder.file("a.mp4")));
  movie.finish();
  EXPECT_EQ(folder.entryCount(), 1u);
  const std::string text = probed(folder.file("a.mp4"));
  for (const char* line :
       {"codec_name=h264", "width=64", "height=36", "pix_fmt=yuv420p", "color_range=tv", "color_space=bt709",
        "color_primaries=bt709", "color_transfer=iec61966-2-1", "r_frame_rate=12/1", "nb_read_frames=6"})
    EXPECT_NE(text.find(std::string(line) + "\n"), std::string::npos) << line << "\n" << text;
}

TEST(Movie, KeepsColours) {
  if (const char* missing = whatIsMissing()) GTEST_SKIP() << missing;
  const test::TemporaryFolder folder;
  Image frame = grey(32, 32, 0.2f);
  for (float& value : frame.channels[0].values) value = 0.5f;
  for (float& value : frame.channels[2].values) value = 0.05f;
  MovieWriter movie(folder.file("a.mp4"), 32, 32, {.quality = 1});
  movie.add(frame, {});
  movie.finish();
  const std::string command = "ffmpeg -v error -i '" + folder.file("a.mp4") +
                              "' -vf scale=in_color_matrix=bt709 -pix_fmt rgb24 -f rawvideo - >'" +
                              folder.file("raw") + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::string raw = test::textOf(folder.file("raw"));
  ASSERT_EQ(raw.size(), 32u * 32u * 3u);
  const std::vector<std::uint8_t> expected = screenBytes(frame, {});
  // Limited range has 219 steps for 255, and the matrix rounds: 3 steps.
  for (std::size_t c = 0; c != 3; ++c)
    EXPECT_NEAR(int(std::uint8_t(raw[16 * 96 + 48 + c])), int(expected[16 * 96 + 48 + c]), 3);
}

TEST(Movie, MakesSizesEven) {
  if (const char* missing = whatIsMissing()) GTEST_SKIP() << missing;
  const test::TemporaryFolder folder;
  const struct {
    int width, height;
    const char *wide, *high;
  } cases[] = {{33, 17, "width=34\n", "height=18\n"},
               {32, 17, "width=32\n", "height=18\n"},
               {1, 1, "width=2\n", "height=2\n"}};
  for (const auto& c : cases) {
    MovieWriter movie(folder.file("a.mp4"), c.width, c.height);
    movie.add(grey(c.width, c.height, 0.5f), {});
    movie.finish();
    const std::string text = probed(folder.file("a.mp4"));
    EXPECT_NE(text.find(c.wide), std::string::npos) << text;
    EXPECT_NE(text.find(c.high), std::string::npos) << text;
  }
}

TEST(Movie, LeavesNothingWhenItIsNotFinished) {
  if (const char* missing = whatIsMissing()) GTEST_SKIP() << missing;
  const test::TemporaryFolder folder;
  {
    MovieWriter movie(folder.file("a.mp4"), 64, 36);
    movie.add(grey(64, 36, 0.5f), {});
  }
  MovieWriter::tryOut(folder.file("a.mp4"), 64, 36, {});
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(Movie, NamesThePackageWhereTheProgramIsMissing) {
  const test::TemporaryFolder folder;
  try {
    MovieWriter::tryOut(folder.file("a.mp4"), 64, 36, {.program = "no-such-ffmpeg"});
    FAIL() << "a movie was made by a program that is not there";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("install the package ffmpeg"), std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("a.mp4"), std::string::npos) << error.what();
  }
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(Movie, TellsWhatTheProgramSaysWhenItFails) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("broken")) << "#!/bin/sh\necho 'no encoder today' >&2\nexit 3\n";
  std::filesystem::permissions(folder.file("broken"), std::filesystem::perms::owner_all);
  try {
    MovieWriter::tryOut(folder.file("a.mp4"), 640, 360, {.program = folder.file("broken")});
    FAIL() << "the failure went unnoticed";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("no encoder today"), std::string::npos) << error.what();
  }
  EXPECT_FALSE(std::filesystem::exists(folder.file("a.mp4")));
}

// ffmpeg ends well, without a word, where the disk was full.
TEST(Movie, RefusesAMovieThatIsNotWhole) {
  if (const char* missing = whatIsMissing()) GTEST_SKIP() << missing;
  const test::TemporaryFolder folder;
  for (const std::string extension : {".mp4", ".mov", ".mkv"}) {
    const std::string path = folder.file("a" + extension);
    {
      MovieWriter movie(path, 64, 36);
      for (int i = 0; i != 4; ++i) movie.add(grey(64, 36, 0.2f * float(i)), {});
      movie.finish();
    }
    const auto size = std::filesystem::file_size(path);
    for (const auto kept : {std::uintmax_t(0), std::uintmax_t(40), size / 2, size - 1}) {
      std::ofstream(folder.file("short")) << "#!/bin/sh\ncat >/dev/null\nfor last; do :; done\nhead -c "
                                          << kept << " '" << path << "' >\"$last\"\n";
      std::filesystem::permissions(folder.file("short"), std::filesystem::perms::owner_all);
      const std::string cut = folder.file("cut" + extension);
      MovieWriter movie(cut, 64, 36, {.program = folder.file("short")});
      movie.add(grey(64, 36, 0.5f), {});
      try {
        movie.finish();
        ADD_FAILURE() << kept << " of " << size << " bytes are a movie";
      } catch (const Error& error) {
        EXPECT_EQ(std::string(error.what()), cut + ": cannot be written whole; the disk may be full");
      }
      EXPECT_FALSE(std::filesystem::exists(cut));
    }
  }
}

TEST(Movie, RefusesBadSizesRatesAndFrames) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("a.mp4");
  EXPECT_THROW(MovieWriter(path, 0, 10), Error);
  EXPECT_THROW(MovieWriter(path, 10, 20000), Error);
  EXPECT_THROW(MovieWriter(path, 10, 10, {.framesPerSecond = 0}), Error);
  EXPECT_THROW(MovieWriter(path, 10, 10, {.quality = 52}), Error);
  EXPECT_THROW(MovieWriter(folder.file("missing/a.mp4"), 10, 10), Error);
  if (const char* missing = whatIsMissing()) GTEST_SKIP() << missing;
  MovieWriter movie(path, 10, 10);
  EXPECT_THROW(movie.add(grey(10, 12, 0), {}), Error);
}

}  // namespace
}  // namespace nephele
