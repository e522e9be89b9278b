#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "apps/app.h"
#include "apps/detail/program_run.h"

namespace nephele::apps {

/// A verb, and the options of one call of it.
class Command {
 public:
  /// Declares the options of `verb`, which must outlive this, and those that every verb takes.
  explicit Command(const Verb& verb);
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  /// Reads the arguments, in order. @throws CLI::ParseError naming what is wrong, or asking for help.
  void parse(std::vector<std::string> arguments);
  /// Whether the verb makes the frames of one call itself.
  bool hasOwnFrames() const { return ownFrames_; }

  const Verb& verb;
  CLI::App app;
  CommonOptions options;
  BoundVerb bound;

 private:
  bool ownFrames_ = false;
};

}  // namespace nephele::apps
