#pragma once

#include <fstream>
#include <sstream>

#include "tests/levelset/felt/levelset_felt.h"

/// The scripts of the notes, which lie beside the checkout.
namespace nephele::felt {

inline std::string listingPath(const std::string& name) {
  return test::sharedData("../listings/" + name + ".felt");
}

inline std::string listing(const std::string& name) {
  std::ifstream file(listingPath(name));
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_FALSE(text.str().empty()) << name;
  return text.str();
}

/// Statements done so many times.
inline std::string repeated(int count, const std::string& statements) {
  return "for (int step = 0; step < " + std::to_string(count) + "; step++) {\n" + statements + "\n}\n";
}

}  // namespace nephele::felt
