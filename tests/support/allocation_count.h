#pragma once

namespace nephele::test {

/// Calls of operator new in this program so far, on all threads. Programs that use it link
/// allocation_count.cpp.
long allocationCount();

}  // namespace nephele::test
