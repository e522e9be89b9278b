#pragma once

#include <CLI/App.hpp>
#include <span>
#include <string>
#include <string_view>

#include "apps/file_hashes.h"

namespace nephele::apps {

/// Says what a call makes: a hash of the options of `app` that were given, the contents of the files that
/// they and these name, the view of an OpenColorIO configuration, the version of the program, and `more`.
/// Outputs, and options of how the program runs, do not count, nor do those named `others`. The same wherever
/// files are that are all of a value, or all behind its equals sign.
std::string optionsDigest(const CLI::App& app, std::span<const std::string_view> others,
                          const std::string& more, FileHashes& files);

/// What is said of outputs that are whole and have another digest.
inline constexpr const char* kOtherDigest =
    "was made with other options, of another input or by another version";

/// The digest that an output carries; "" if it carries none, as meshes do. Reads it to its last byte.
/// @throws Error naming the path if it is not whole.
std::string outputDigest(const std::string& path);

/// Why the file at `path` is not whole or has another digest than `digest`; "" if it is and has it. Meshes
/// need only be whole.
std::string outputDefect(const std::string& path, const std::string& digest);

}  // namespace nephele::apps
