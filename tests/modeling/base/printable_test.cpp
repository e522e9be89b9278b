#include "nephele/modeling/base/printable.h"

#include <gtest/gtest.h>

namespace nephele {
namespace {

TEST(Printable, ControlCharactersAreSpelledAndLettersStay) {
  EXPECT_EQ(printable("two\nlines\tand \x1b[31m red\x7f"), "two\\nlines\\tand \\x1b[31m red\\x7f");
  EXPECT_EQ(printable("Größe \xe9"), "Größe \xe9");
  EXPECT_EQ(printable("twelve chars", 12), "twelve chars");
  EXPECT_EQ(printable("thirteen char", 12), "thirteen ...");
}

TEST(Printable, FaultsInJsonAreToldWithoutTheLibrarysWords) {
  EXPECT_EQ(jsonFault("[json.exception.parse_error.101] parse error at line 1, column 2: syntax error"),
            "syntax error");
  EXPECT_EQ(jsonFault("[json.exception.out_of_range.406] number overflow parsing '1e999'"),
            "number overflow parsing '1e999'");
  EXPECT_EQ(jsonFault("[json.exception.type_error.302] " + std::string(1000, '1')).size(), 160u);
}

// The edges of each length, RFC 3629: shortest forms only, no surrogates, nothing beyond U+10FFFF.
TEST(IsUtf8, TakesWholeCharactersOnly) {
  for (const char* text : {"", "plain\n", "\xc2\x80", "\xdf\xbf", "\xe0\xa0\x80", "\xed\x9f\xbf",
                           "\xee\x80\x80", "\xef\xbf\xbf", "\xf0\x90\x80\x80", "\xf4\x8f\xbf\xbf"})
    EXPECT_TRUE(isUtf8(text)) << text;
  for (const char* text :
       {"\x80", "\xc2", "\xc1\xbf", "\xe0\x9f\xbf", "\xed\xa0\x80", "\xed\xbf\xbf", "\xf0\x8f\xbf\xbf",
        "\xf4\x90\x80\x80", "\xf8\x88\x80\x80\x80", "caf\xe9", "\xe9t\xe9", "\xe2\x82"})
    EXPECT_FALSE(isUtf8(text)) << text;
}

}  // namespace
}  // namespace nephele
