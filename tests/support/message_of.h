#pragma once

#include <functional>
#include <string>

#include "nephele/modeling/base/error.h"

namespace nephele::test {

/// What the Error says that `work` throws.
inline std::string messageOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace nephele::test
