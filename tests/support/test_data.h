#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace nephele::test {

/// Path of a file of the shared test data beside the checkout, e.g. "meshes/spot_uv.obj".
std::string sharedData(const std::string& name);

}  // namespace nephele::test

/// Skips the running test, saying so, where the shared test data is not installed.
#define NEPHELE_REQUIRE_SHARED_DATA(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "shared test data not here: " << path
