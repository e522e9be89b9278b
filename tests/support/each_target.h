#pragma once

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <string>

namespace nephele::test {

/// Calls `body` once with each instruction set that this machine has, as if it were the best one, and once
/// with none.
template <class Body>
void forEachTarget(const Body& body) {
  const std::int64_t supported = hwy::SupportedTargets();
  std::int64_t rest = supported;
  do {
    const std::int64_t target = rest & -rest;
    rest &= rest - 1;
    SCOPED_TRACE(target ? hwy::TargetName(target) : "portable code");
    hwy::GetChosenTarget().Update(target);
    body();
    if (target == 0) break;
  } while (true);
  hwy::GetChosenTarget().Update(supported);
}

}  // namespace nephele::test
