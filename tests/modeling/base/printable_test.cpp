#include "nephele/modeling/base/printable.h"

#include <gtest/gtest.h>

#include <clocale>
#include <limits>
#include <string>

namespace nephele {
namespace {

TEST(Printable, ControlCharactersAreSpelledAndLettersStay) {
  EXPECT_EQ(printable("two\nlines\tand \x1b[31m red\x7f"), "two\\nlines\\tand \\x1b[31m red\\x7f");
  EXPECT_EQ(printable("Größe \xe9"), "Größe \xe9");
  EXPECT_EQ(printable("twelve chars", 12), "twelve chars");
  EXPECT_EQ(printable("thirteen char", 12), "thirteen ...");
}

TEST(NumberText, HasSixDigits) {
  EXPECT_EQ(numberText(-1), "-1");
  EXPECT_EQ(numberText(0.1f), "0.1");
  EXPECT_EQ(numberText(1.0 / 3), "0.333333");
  EXPECT_EQ(numberText(-1e-9), "-1e-09");
  EXPECT_EQ(numberText(12345678), "1.23457e+07");
  EXPECT_EQ(numberText(std::numeric_limits<double>::infinity()), "inf");
}

// Programs with windows take over the locale of their users, and Python's modules live in it.
TEST(NumberText, HasAPointInLocalesWithCommas) {
  const std::string before = std::setlocale(LC_NUMERIC, nullptr);
  if (!std::setlocale(LC_NUMERIC, "de_DE.UTF-8")) GTEST_SKIP() << "there is no locale de_DE.UTF-8 here";
  const std::string text = numberText(1.5);
  std::setlocale(LC_NUMERIC, before.c_str());
  EXPECT_EQ(text, "1.5");
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
