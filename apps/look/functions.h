#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

#include "apps/look/server.h"

namespace nephele::apps {

/// What program and module must agree on, and the function that the module has.
struct LookFunctions {
  char version[48] = "nephele-look " NEPHELE_VERSION;
  std::size_t sizes[3] = {sizeof(LookServerOptions), sizeof(LookSettings), sizeof(LookSubject)};
  decltype(&makeLookServer) make = nullptr;

  bool isOf(const LookFunctions& other) const {
    return std::string_view(version) == other.version && std::ranges::equal(sizes, other.sizes);
  }
};

}  // namespace nephele::apps
