#pragma once

#include <string>

#include "tests/fuzz/formats.h"

namespace nephele::fuzz {

/// JSON with some of its values replaced, copied, removed or changed, numbers mostly by those at ends of
/// ranges; still JSON. What is none stays as it is.
std::string changedJson(const std::string& text, unsigned seed, const ByteChange& change);

/// As Mutator: the same of a whole file.
std::size_t mutateJson(Bytes bytes, std::size_t size, unsigned seed, const ByteChange& change);

}  // namespace nephele::fuzz
