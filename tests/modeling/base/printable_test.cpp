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

}  // namespace
}  // namespace nephele
