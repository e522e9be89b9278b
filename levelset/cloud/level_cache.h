#pragma once

#include <optional>
#include <string>

#include "nephele/levelset/cloud/cloud_density.h"

namespace nephele {

/// A folder in which the levels of clouds are kept from one run to the next.
///
/// Each has a file of its own, cloud_layers_KEY.vdb, which also a viewer can show; no other files are
/// touched. Any number of processes may use a folder at once: files are written beside their names and
/// renamed. What goes wrong is told as a note and stops nothing: what cannot be read is not there, what
/// cannot be written is not kept.
class LevelCache {
 public:
  struct Options {
    std::string folder;
    /// Of all files together; the oldest go, by when they were last of use.
    double mostBytes = 20e9;
  };

  explicit LevelCache(const Options& options) : options_(options) {}

  /// The levels kept under `key`, which says all that they depend on, or nothing.
  std::optional<CloudLevels> read(const std::string& key, const Progress& progress = silent()) const;
  /// Keeps levels; returns whether they are there now.
  bool write(const std::string& key, const CloudLevels& levels, const Progress& progress = silent()) const;

  std::string pathOf(const std::string& key) const;

 private:
  void forgetOldest(const std::string& kept, const Progress& progress) const;

  Options options_;
};

}  // namespace nephele
