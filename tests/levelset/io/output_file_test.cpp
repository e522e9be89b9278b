#include "nephele/levelset/io/output_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/full_disk.h"
#include "tests/support/message_of.h"
#include "tests/support/run_program.h"

namespace nephele {
namespace {

using test::messageOf;

using test::TemporaryFolder;
using test::textOf;

void write(const std::string& path, const std::string& text) {
  std::ofstream(path) << text;
}

TEST(OutputFile, AppearsOnCommitUnderItsName) {
  const TemporaryFolder folder;
  OutputFile output(folder.file("a.obj"));
  write(output.temporaryPath(), "whole");
  EXPECT_FALSE(std::filesystem::exists(folder.file("a.obj")));
  output.commit();
  EXPECT_EQ(textOf(folder.file("a.obj")), "whole");
  EXPECT_EQ(folder.entryCount(), 1u);
}

TEST(OutputFile, LeavesNothingWithoutCommitAndKeepsWhatWasThere) {
  const TemporaryFolder folder;
  write(folder.file("a.obj"), "before");
  {
    const OutputFile output(folder.file("a.obj"));
    write(output.temporaryPath(), "half");
  }
  EXPECT_EQ(textOf(folder.file("a.obj")), "before");
  EXPECT_EQ(folder.entryCount(), 1u);
}

TEST(OutputFile, TemporaryHasTheExtensionAndFolderOfTheTarget) {
  const TemporaryFolder folder;
  const OutputFile output(folder.file("cloud.0001.vdb"));
  const std::filesystem::path temporary(output.temporaryPath());
  EXPECT_EQ(temporary.extension(), ".vdb");
  EXPECT_EQ(temporary.parent_path().string() + "/cloud.0001.vdb", folder.file("cloud.0001.vdb"));
}

TEST(OutputFile, TwoOutputsOfOneNameDoNotShareATemporary) {
  const TemporaryFolder folder;
  const OutputFile a(folder.file("a.obj")), b(folder.file("a.obj"));
  EXPECT_NE(a.temporaryPath(), b.temporaryPath());
}

TEST(OutputFile, KeepsASymbolicLinkAndWritesWhatItLeadsTo) {
  namespace fs = std::filesystem;
  const TemporaryFolder folder;
  fs::create_directory(folder.file("store"));
  fs::create_symlink("store/real.obj", folder.file("a.obj"));
  for (const std::string text : {"first", "second"}) {
    OutputFile output(folder.file("a.obj"));
    EXPECT_EQ(fs::path(output.temporaryPath()).parent_path().string(), folder.file("store"))
        << "renaming needs the folder of what the link leads to";
    write(output.temporaryPath(), text);
    output.commit();
    EXPECT_TRUE(fs::is_symlink(folder.file("a.obj")));
    EXPECT_EQ(textOf(folder.file("store/real.obj")), text);
  }
  fs::create_symlink("round.obj", folder.file("round.obj"));
  EXPECT_NE(messageOf([&] { const OutputFile output(folder.file("round.obj")); }).find("circle"),
            std::string::npos);
}

// A named pipe stands in for devices: it, too, takes bytes and must not be replaced by a file.
TEST(OutputFile, WritesIntoAStreamAndLeavesItThere) {
  const TemporaryFolder folder;
  const std::string pipe = folder.file("pipe.obj");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  // Both ends in one process: nobody waits.
  const int reader = ::open(pipe.c_str(), O_RDWR | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  EXPECT_TRUE(isStream(pipe));
  OutputFile output(pipe);
  write(output.temporaryPath(), "bytes");
  output.commit();
  output.withdraw();
  char text[16] = {};
  EXPECT_EQ(::read(reader, text, sizeof(text)), 5);
  EXPECT_STREQ(text, "bytes");
  ::close(reader);
  EXPECT_TRUE(isStream(pipe)) << "neither replaced nor removed";
  EXPECT_FALSE(std::filesystem::exists(output.temporaryPath()));
  EXPECT_FALSE(isStream(folder.file("none"))) << "what is not there";
  EXPECT_FALSE(isStream(folder.file("")));
}

TEST(OutputFile, HasTheUsualPermissions) {
  const TemporaryFolder folder;
  const mode_t mask = umask(027);
  OutputFile output(folder.file("a.obj"));
  output.commit();
  umask(mask);
  struct stat status {};
  ASSERT_EQ(stat(folder.file("a.obj").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0640u);
}

TEST(OutputFile, MissingFolderIsNamed) {
  const TemporaryFolder folder;
  const std::string message = messageOf([&] { OutputFile output(folder.file("none/a.obj")); });
  EXPECT_NE(message.find("none does not exist"), std::string::npos) << message;
}

TEST(OutputFile, FolderAsTargetIsRefused) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkdir(folder.file("a.obj").c_str(), 0777), 0);
  const std::string message = messageOf([&] { OutputFile output(folder.file("a.obj")); });
  EXPECT_NE(message.find("it is a folder"), std::string::npos) << message;
  EXPECT_NE(messageOf([&] { OutputFile output(folder.file("a.obj/")); }).find("it is a folder"),
            std::string::npos);
  EXPECT_EQ(folder.entryCount(), 1u);
}

TEST(OutputFile, FileAsFolderIsRefused) {
  const TemporaryFolder folder;
  write(folder.file("file"), "x");
  const std::string message = messageOf([&] { OutputFile output(folder.file("file/a.obj")); });
  EXPECT_NE(message.find("is not a folder"), std::string::npos) << message;
}

TEST(OutputFile, UnwritableFolderIsRefused) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkdir(folder.file("locked").c_str(), 0555), 0);
  // Nothing is unwritable for the super-user, who therefore becomes nobody for a moment.
  const bool isSuperUser = geteuid() == 0;
  if (isSuperUser) {
    ASSERT_EQ(chmod(folder.file("").c_str(), 0755), 0);
    ASSERT_EQ(seteuid(65534), 0);
  }
  const std::string message = messageOf([&] { OutputFile output(folder.file("locked/a.obj")); });
  if (isSuperUser) {
    ASSERT_EQ(seteuid(0), 0);
  }
  EXPECT_NE(message.find("Permission denied"), std::string::npos) << message;
}

// 255 bytes are the longest name there is.
TEST(OutputFile, NamesMayBeAsLongAsTheSystemAllows) {
  const TemporaryFolder folder;
  std::string stem(255, 'n'), extension(255, 'e');
  stem.replace(251, 4, ".vdb");
  extension.replace(0, 2, "a.");
  for (const std::string* name : {&stem, &extension}) {
    OutputFile output(folder.file(*name));
    write(output.temporaryPath(), "text");
    output.commit();
    EXPECT_EQ(textOf(folder.file(*name)), "text");
  }
  EXPECT_NE(messageOf([&] { OutputFile output(folder.file(std::string(256, 'n'))); }).find("too long"),
            std::string::npos);
}

TEST(OutputFile, DiscardingRemovesEveryOpenTemporaryButNoFinishedFile) {
  const TemporaryFolder folder;
  OutputFile finished(folder.file("a.obj"));
  finished.commit();
  const OutputFile b(folder.file("b.obj")), c(folder.file("c.obj"));
  EXPECT_EQ(folder.entryCount(), 3u);
  discardAllOutputs();
  EXPECT_EQ(folder.entryCount(), 1u);
  EXPECT_TRUE(std::filesystem::exists(folder.file("a.obj")));
}

TEST(OutputFile, CommitAfterDiscardingSaysThatItFailed) {
  const TemporaryFolder folder;
  OutputFile output(folder.file("a.obj"));
  discardAllOutputs();
  EXPECT_NE(messageOf([&] { output.commit(); }).find("a.obj"), std::string::npos);
}

TEST(OutputFile, FullDiskFailsTheMeshWritersAndLeavesNothing) {
  Mesh strip;
  for (int i = 0; i < 5000; ++i) {
    strip.positions.emplace_back(i, i % 2, 0);
    if (i > 1)
      strip.addFace(std::vector<std::uint32_t>{std::uint32_t(i - 2), std::uint32_t(i - 1), std::uint32_t(i)});
  }
  for (const char* name : {"a.obj", "a.ply", "a.stl"}) {
    // 100 bytes: fails when the last buffer is flushed; 80 000 bytes: fails in the middle.
    for (const rlim_t bytes : {rlim_t{100}, rlim_t{80000}}) {
      const TemporaryFolder folder;
      std::string message;
      {
        const test::FullDisk full(bytes);
        message = messageOf([&] { writeMesh(folder.file(name), strip); });
      }
      EXPECT_NE(message.find(folder.file(name)), std::string::npos) << message;
      EXPECT_NE(message.find("File too large"), std::string::npos) << message;
      EXPECT_EQ(folder.entryCount(), 0u);
    }
  }
}

TEST(OutputFile, NamesThatWouldEndAtAByteOfZeroAreRefusedByEveryReaderAndWriter) {
  const TemporaryFolder folder;
  const std::string fault = "\\x00.obj: the name of a file may not have a byte of zero in it";
  const auto named = [&](const char* name) { return folder.file(name) + std::string("\0.obj", 5); };
  Mesh triangle;
  triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  triangle.addFace(std::vector<std::uint32_t>{0, 1, 2});
  EXPECT_EQ(messageOf([&] { writeMesh(named("a.obj"), triangle); }), folder.file("a.obj") + fault);
  EXPECT_EQ(folder.entryCount(), 0u);
  for (const char* name : {"a.obj", "a.vdb", "a.nvdb"}) std::ofstream(folder.file(name)) << "v 0 0 0\n";
  EXPECT_EQ(messageOf([&] { readMesh(named("a.obj")); }), folder.file("a.obj") + fault);
  for (const char* name : {"a.vdb", "a.nvdb"})
    EXPECT_EQ(messageOf([&] { readVdbFile(named(name)); }), folder.file(name) + fault);
}

}  // namespace
}  // namespace nephele
