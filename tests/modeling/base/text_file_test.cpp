#include "nephele/modeling/base/text_file.h"

#include <gtest/gtest.h>

#include <fstream>

#include "nephele/modeling/base/error.h"
#include "tests/support/message_of.h"
#include "tests/support/run_program.h"

namespace nephele {
namespace {

using test::messageOf;

TEST(TextFile, HoldsAllBytesOfAFile) {
  const test::TemporaryFolder folder;
  std::string text(200000, 'a');
  text[100000] = '\0';
  std::ofstream(folder.file("a.txt"), std::ios::binary) << text;
  EXPECT_EQ(readTextFile(folder.file("a.txt"), text.size()), text);
  EXPECT_EQ(readTextFile("/dev/null", 0), "");
  std::ofstream(folder.file("mark.txt")) << "\xef\xbb\xbf"
                                         << "text";
  EXPECT_EQ(readTextFile(folder.file("mark.txt"), 100), "text") << "without its mark of byte order";
}

TEST(TextFile, WhatCannotBeReadIsRefused) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("a.txt")) << "four";
  EXPECT_EQ(messageOf([&] { readTextFile(folder.file("a.txt"), 3); }),
            folder.file("a.txt") + ": is larger than 3 bytes");
  EXPECT_EQ(messageOf([&] { readTextFile("/dev/zero", 1 << 20); }),
            "/dev/zero: is larger than 1048576 bytes");
  EXPECT_EQ(messageOf([&] { readTextFile(folder.file("none"), 3); }),
            folder.file("none") + ": cannot be opened for reading");
  EXPECT_EQ(messageOf([&] { readTextFile(folder.file("."), 3); }),
            folder.file(".") + ": is a folder, not a file");
}

TEST(TextFile, NamesThatWouldEndAtAByteOfZeroAreRefusedAndShownWhole) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("a.txt")) << "four";
  const std::string fault = "the name of a file may not have a byte of zero in it";
  const std::string name = folder.file("a.txt") + std::string("\0b", 2);
  EXPECT_EQ(messageOf([&] { readTextFile(name, 9); }), folder.file("a.txt") + "\\x00b: " + fault);
  EXPECT_EQ(messageOf([&] { namingFile(name, [&] { return readTextFile(name, 9); }); }),
            folder.file("a.txt") + "\\x00b: " + fault);
  EXPECT_EQ(messageOf([&] { namingFile(name, []() -> int { throw Error("is odd"); }); }),
            folder.file("a.txt") + "\\x00b: is odd");
}

}  // namespace
}  // namespace nephele
