#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "nephele/modeling/base/error.h"

// What may happen and what may not while an input is used.
namespace nephele::fuzz {

/// What is read next; what it says may be quoted in messages.
void setInput(std::string_view bytes);

/// Ends the process with a report that has `message` in it.
[[noreturn]] void fail(std::string_view message);
inline void expect(bool isTrue, std::string_view message) {
  if (!isTrue) fail(message);
}

/// A message for a person: one line, no words of libraries, and `named` in it.
void checkMessage(std::string_view message, std::string_view named);

/// What the last work that did not succeed said.
std::string& lastError();

/// Whether `work` ends without an Error. Anything else that it throws is a finding, and so is an Error that
/// does not name `named`.
template <class Work>
bool succeeds(std::string_view named, const Work& work) {
  try {
    work();
    return true;
  } catch (const Error& error) {
    checkMessage(error.what(), named);
    lastError() = error.what();
    return false;
  }
}

/// Runs a verb of the program in this process, with little memory. Returns whether it succeeded; where it did
/// not, its message must name `named`, and its output must not be there.
bool runVerb(std::vector<std::string> arguments, std::string_view named);

/// Runs `render` likewise, with its light and its few pixels made as fast as they can be where `arguments` do
/// not say otherwise.
bool runRender(std::vector<std::string> arguments, std::string_view named);

std::vector<std::string> linesOf(std::string_view text);

/// A file in this process's own folder in memory.
std::string scratchPath(std::string_view name);

/// A ball as a level set (.vdb), a fog ball (.vdb) and a mesh with texture coordinates (.obj), made once.
const std::string& ballLevelSet();
const std::string& ballFog();
const std::string& ballMesh();

}  // namespace nephele::fuzz
