#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

// What is fuzzed: one kind of file after the other, each read and then used as the program uses it.
namespace nephele::fuzz {

/// One input, on disk and in memory.
struct Input {
  std::string path;
  std::string_view bytes;
  /// Another number for other bytes: decides what is done with what was read.
  std::uint64_t hash = 0;

  std::string extension() const { return path.substr(path.rfind('.')); }
};

using Bytes = std::span<std::uint8_t>;

/// Changes the first `size` of `bytes`, of which all may be used; returns the new size.
using ByteChange = std::function<std::size_t(Bytes bytes, std::size_t size)>;
/// Likewise; knows how the format is built, and changes what is inside by `change`.
using Mutator = std::size_t (*)(Bytes bytes, std::size_t size, unsigned seed, const ByteChange& change);

struct Format {
  std::string_view name;
  std::string_view extension;
  /// Returns whether it could be read.
  bool (*use)(const Input& input);
  /// Of formats that bytes changed at random never get into.
  Mutator mutator = nullptr;
};

std::span<const Format> formats();

bool useMesh(const Input& input);
bool useVolume(const Input& input);
bool usePicture(const Input& input);
bool useDeepPicture(const Input& input);
bool useCamera(const Input& input);
/// What follows on a line "...", the end of YAML, is a table that the configuration may name.
bool useViewConfig(const Input& input);
bool useToml(const Input& input);
bool useFieldTexts(const Input& input);
/// A verb and its arguments, one a line. Whether it did its work.
bool useVerb(const Input& input);
bool useScript(const Input& input);
/// The bytes are no file but say which calls write some, in which order. What can be read is what these have
/// written.
bool useCalls(const Input& input);

}  // namespace nephele::fuzz
