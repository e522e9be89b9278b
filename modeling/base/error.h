#pragma once

#include <stdexcept>
#include <string>

namespace nephele {

/// The one exception type of the library: bad arguments, bad files, work that cannot be done.
/// The message is a sentence for a person: it names the argument or file, the value found and what is
/// allowed. Bytes of zero, at which `what()` would end, are shown as \x00.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message);
};

/// Thrown out of long work when its Progress reports that it was cancelled.
class Cancelled : public Error {
 public:
  Cancelled() : Error("cancelled") {}
};

/// Checks an argument of a public entry point; always on.
/// @throws Error with `message` if `condition` is false.
inline void require(bool condition, const char* message) {
  if (!condition) throw Error(message);
}
inline void require(bool condition, const std::string& message) {
  if (!condition) throw Error(message);
}

/// What `work` gives; its errors begin with the file that they are about, if it has a name.
/// @throws Error, Cancelled as `work` does
template <class Work>
auto namingFile(const std::string& path, const Work& work) {
  try {
    return work();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    const std::string message = error.what();
    if (message.starts_with(path.c_str())) throw;
    throw Error(path + ": " + message);
  }
}

}  // namespace nephele
