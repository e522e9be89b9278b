#include "nephele/levelset/io/file_bytes.h"

#include <gtest/gtest.h>

#include <fstream>

#include "nephele/modeling/base/error.h"
#include "tests/support/run_program.h"

namespace nephele {
namespace {

// Longer than the megabyte that is in memory at a time; every byte tells where it lies.
std::string numberedBytes(std::size_t count) {
  std::string bytes(count, '\0');
  for (std::size_t i = 0; i != count; ++i) bytes[i] = char(i * 7 % 251);
  return bytes;
}

TEST(FileBytes, ReadsWhatLiesInTheFileAcrossItsWindows) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("a.bin"), bytes = numberedBytes((std::size_t(5) << 20) / 2);
  std::ofstream(path, std::ios::binary) << bytes;
  FileBytes file(path);
  std::string read;
  for (const std::size_t count : {std::size_t(3), std::size_t(1) << 20, std::size_t(100), std::size_t(0)}) {
    std::string part(count, ' ');
    ASSERT_EQ(file.sgetn(part.data(), std::streamsize(count)), std::streamsize(count));
    read += part;
  }
  EXPECT_EQ(read, bytes.substr(0, read.size()));
  EXPECT_EQ(file.position(), std::int64_t(read.size()));
}

TEST(FileBytes, ReadsNothingToNowhere) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("a.bin");
  std::ofstream(path, std::ios::binary) << "abc";
  FileBytes file(path);
  EXPECT_EQ(file.sgetn(nullptr, 0), 0);
  EXPECT_EQ(file.take<char>(), 'a');
}

TEST(FileBytes, ThrowsRatherThanEnd) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("a.bin");
  std::ofstream(path, std::ios::binary) << "abc";
  FileBytes file(path);
  EXPECT_THROW(file.take<std::uint64_t>(), Error);
  EXPECT_THROW(file.moveTo(4), Error);
}

}  // namespace
}  // namespace nephele
