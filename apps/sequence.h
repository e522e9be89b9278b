#pragma once

#include <CLI/App.hpp>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "apps/app.h"
#include "nephele/render/image/frame_range.h"

namespace nephele::apps {

/// The frames of `range` that are in `only`, and of these the share I/N of `shard`, each where it is not "".
/// @throws CLI::ValidationError naming --only or --shard.
std::vector<int> chosenFrames(const FrameRange& range, const std::string& only, const std::string& shard);

/// Refuses inputs called `name` of which one is missing. @throws Error naming the frames that are.
void requireFrames(const std::string& name, const std::vector<int>& frames,
                   const std::function<std::string(int frame)>& path);

/// Refuses volumes of which one has another first grid of numbers than that of the first frame, or is a level
/// set where that is not; notes other differences. Files that are no volumes are left alone.
/// @throws Error naming the file.
void requireSameGrids(const std::vector<int>& frames, const std::function<std::string(int frame)>& path,
                      const Run& run);

/// One of the calls that a command line stands for.
struct Call {
  /// "frame 12"
  std::string name;
  Run::Part part{};
  /// What sets it apart, for --stats: {"frame": 12}
  nlohmann::json values{};
  std::vector<std::string> arguments{};
};

/// A command line that stands for one call for each of its --frames: every argument with a place for the
/// frame number (####, %04d, $F4) has the number there.
/// --only and --shard say which of them this call makes.
class Sequence {
 public:
  /// Nothing where `arguments` have no --frames. @throws CLI::ValidationError naming what is wrong: the
  /// frames, no argument with a place for their number, or one with two.
  static std::optional<Sequence> of(const std::vector<std::string>& arguments);

  /// Of all frames, by an index below `size`.
  Call call(std::size_t index) const;
  std::size_t size() const { return range_.frames().size(); }
  /// The indices of the frames to make.
  std::vector<std::size_t> made() const;

  /// Looks before the work whether it can be done, `first` being the options of the first call: outputs need
  /// a place for the number, inputs must be there for every frame, and volumes hold the same grids. Makes the
  /// folders of outputs.
  /// What is in `known` has been looked at already; what is looked at is added.
  /// @throws CLI::ValidationError naming the option, Error naming the frames that are missing, or the file.
  void check(const CLI::App& first, std::set<std::string>& known, const Run& run) const;

  /// Options of outputs, `first` being those of the first call, and the file of each by the index of a frame.
  std::vector<std::pair<std::string, std::function<std::string(std::size_t)>>> outputs(
      const CLI::App& first) const;

  /// Whether an input differs from frame to frame.
  bool variesInputs(const CLI::App& first) const { return !inputs(first).empty(); }

 private:
  /// An argument with a place for the number.
  struct Word {
    std::size_t index;
    FramePattern pattern;
  };
  /// A file of every frame: the argument, and how much of it stands before and behind the name of the file.
  struct File {
    const Word* word;
    std::size_t before, behind;
    std::string path(int frame) const { return nameIn(word->pattern.path(frame)); }
    std::string name() const { return nameIn(word->pattern.text()); }
    std::string nameIn(const std::string& text) const {
      return before + behind < text.size() ? text.substr(before, text.size() - before - behind) : "";
    }
  };

  explicit Sequence(std::vector<std::string> arguments);
  /// The word that `value` of an option comes from; null where it is the same in all frames.
  const Word* wordOf(const std::string& value) const;
  std::vector<File> inputs(const CLI::App& first) const;
  void requireNumberedOutputs(const CLI::App& first) const;

  std::vector<std::string> arguments_;
  FrameRange range_;
  std::vector<int> chosen_;
  std::vector<Word> words_;
};

/// Refuses names with #### or %04d where there are no frames: of outputs, and of inputs that are not there.
/// @throws CLI::ValidationError
void refuseFrameNames(const CLI::App& app);

}  // namespace nephele::apps
