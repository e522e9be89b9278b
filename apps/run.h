#pragma once

#include <fmt/format.h>

#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/extent.h"
#include "apps/file_hashes.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {
class PictureStages;
}

namespace nephele::apps {

/// What the body of a verb works with: progress, statistics, limits. One per run of the program.
class Run : public Progress {
 public:
  /// The statistics object written to --stats; `command`, `version`, `seconds`, `peak_memory_bytes` and
  /// `stages` are filled in by the program, the rest by the verb.
  nlohmann::json stats = nlohmann::json::object();

  /// The command line as typed, for file metadata.
  std::string commandLine;

  /// The options that came from --config, as they would be typed; "" where none did.
  std::string configOptions;

  /// One of several calls that a command line stands for, by --frames or --wedge.
  struct Part {
    /// The frame, and how many come before it in the numbering; nothing in a wedge.
    std::optional<int> frame{};
    int framesSinceFirst = 0;
    /// All inputs together, where they differ: what is chosen from the input is chosen from this.
    std::optional<Extent> range{};
    /// Says what this part is made of, for --skip-existing; see kPartDigest.
    std::string digest{};
  };
  std::optional<Part> part;

  /// The frame, in a sequence.
  std::optional<int> frame() const { return part ? part->frame : std::nullopt; }
  /// The longest side of `own`, the box of the input; in a sequence that of its largest frame.
  double longestSide(const Box& own) const;
  /// `own`; in a sequence the box around all inputs.
  Box box(const Box& own) const;

  /// Metadata that every output carries: creator, version, command line, options of a configuration file, and
  /// of which frame it is.
  std::map<std::string, std::string> metadata() const;

  /// Refuses work that needs more than --memory-limit.
  /// @throws Error naming the estimate, the limit and `remedy` (the option to change).
  void requireMemory(double estimatedBytes, const std::string& remedy) const;

  /// The next `stages` stages, each as long as the others, take the whole run from the share `from` to `to`:
  /// what farm software is told. Where a verb does not say, every stage takes half of what is left.
  virtual void expect(double from, double to, int stages = 1) const = 0;

  /// As `note`, for those who asked for more: shown with --verbose.
  virtual void detail(std::string_view message) const = 0;

  /// A line of result on stdout.
  virtual void result(const std::string& line) const = 0;

  double memoryLimitBytes = 0;

  /// Of the files that are read.
  FileHashes files;
  /// The steps to the picture before, by pictureKeys, for those that follow; null where none follows.
  std::shared_ptr<PictureStages> pictureStages;
};

/// What is wrong with several things, one line each.
class SeveralErrors : public Error {
 public:
  explicit SeveralErrors(std::vector<std::string> messages)
      : Error(fmt::format("{}", fmt::join(messages, "; "))), messages_(std::move(messages)) {}
  const std::vector<std::string>& messages() const { return messages_; }

 private:
  std::vector<std::string> messages_;
};

/// Exit codes of a run that failed, and of a command line or a script that cannot be used.
inline constexpr int kFailed = 1, kUsage = 2;

/// Ends a run whose faults have been printed already.
struct AlreadyTold {
  int exitCode = kFailed;
};

/// The metadata that holds Run::Part::digest.
inline constexpr const char* kPartDigest = "nephele:options";

}  // namespace nephele::apps
