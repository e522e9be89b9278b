#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/formats.h"

namespace nephele::fuzz {

/// One verb on small files of its own, in the folder that it runs in.
struct VerbCall {
  std::string_view verb;
  /// What it cannot do without: its input and output.
  std::vector<std::string> needed;
  /// Options, each with its value, that make it quick; those that are given come before them.
  std::vector<std::string> quick;
};

/// Every verb that does its work in one call.
std::span<const VerbCall> verbCalls();
/// Null if there is none of that name.
const VerbCall* callOf(std::string_view verb);

/// Names of files that verbs run on, all in the folder that they run in, and of one that is not there.
std::span<const std::string_view> verbFiles();

/// As Mutator: adds options of the verb to a line of arguments, with values of the form that its help shows,
/// removes some and changes others.
std::size_t mutateArguments(Bytes bytes, std::size_t size, unsigned seed, const ByteChange& change);

}  // namespace nephele::fuzz
