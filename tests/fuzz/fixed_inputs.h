#pragma once

#include <string>

#include "tests/fuzz/formats.h"

namespace nephele::fuzz {

/// Writes `count` changed files of `seeds`, a folder, into the folder `inputs`: bits turned, numbers
/// replaced, ranges cut, copied, doubled or filled with noise, files joined, mostly within what the format's
/// mutator opens. They follow from the seeds alone: the input of a number is the same whenever it is made.
void writeFixedInputs(const Format& format, const std::string& seeds, const std::string& inputs, int count);

}  // namespace nephele::fuzz
