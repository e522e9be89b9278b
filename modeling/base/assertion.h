#pragma once

#include <cassert>

/// States what our own code guarantees: stops a debug build where it does not hold, and is nothing in a
/// release. Never for arguments of users or contents of files, which `require` checks always.
#define NEPHELE_ASSERT(condition) assert(condition)
