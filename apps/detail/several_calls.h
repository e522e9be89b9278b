#pragma once

#include <functional>

#include "apps/detail/command.h"
#include "apps/detail/program_run.h"
#include "apps/sequence.h"

namespace nephele::apps {

/// The calls that one command line stands for.
struct SeveralCalls {
  std::size_t count = 0;
  std::function<Call(std::size_t)> at;
  /// Which of them to make.
  std::vector<std::size_t> made{};
  /// Inputs differ, so that what is chosen from them is chosen from all; or from so many calls in turn, where
  /// they are several sequences.
  bool variesInputs = false;
  std::size_t perRange = 0;
  /// What --stats calls their list, and what messages call them: "frames"
  std::string list, word;
  bool skipExisting = false;

  /// The number of the range that call `i` chooses from.
  std::size_t rangeOf(std::size_t i) const { return perRange == 0 ? 0 : i / perRange; }
};

/// A call that was made: what it wrote, "" where it did not, and the look that was asked for.
struct MadeCall {
  std::string name, output, preview, look;
};

/// Makes one call after another, each on all threads. What is whole stays where a later one fails or is
/// stopped, and it is said how many there are. The statistics of `run` get the list of calls.
/// @throws as the verb does.
std::vector<MadeCall> makeCalls(const Verb& verb, const SeveralCalls& calls, ProgramRun& run);

}  // namespace nephele::apps
