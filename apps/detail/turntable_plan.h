#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/options/picture/scene_options.h"
#include "nephele/render/image/frame_range.h"
#include "nephele/render/image/movie.h"
#include "nephele/render/scene/turntable.h"

namespace nephele::apps {

class LivePicture;
class TurntableScene;

/// The options of the verb turntable, as typed.
struct TurntableOptions {
  SceneOptions scene;
  std::string output, preview, movie, contactSheet;
  std::string frames, only, shard;
  Orbit orbit = Orbit::camera;
  double turns = 1;
  bool skipExisting = false;
  MovieWriter::Options movieOptions;
  PictureOptions picture;
  /// What these were read from.
  const CLI::App* app = nullptr;

  /// What messages call the pictures: the first of the outputs.
  const std::string& name() const;
};

/// One frame of a turntable.
struct TurntableFrame {
  int number = 0;
  /// "" where no such picture is wanted, or nothing stands in front.
  std::string path, preview, deep, holdout;
  std::vector<std::string> inputs{};
  /// Frames of equal ones show the same volume.
  std::string volumeKey{};
  /// Says what the frame is made of: the options that its pixels depend on, as typed, the contents of the
  /// files that these name, its number, first and last frame, and the version of the program. The attribute
  /// kPartDigest.
  std::string digest{};
  /// The same of its preview, with how that is shown.
  std::string previewDigest{};
  /// The files are there and whole, and are left as they are.
  bool skipped = false, previewSkipped = false;
  double seconds = 0;
  /// That it was made of.
  float voxelSize = 0;
};

/// What a call of the verb has to make.
class TurntablePlan {
 public:
  /// @throws CLI::ValidationError naming the option that is wrong; Error naming volumes or holdouts that are
  /// missing, or a volume with other grids than that of the first frame.
  TurntablePlan(const TurntableOptions& options, Run& run);

  /// Where the volume changes from frame to frame, reads it in all of the whole turntable and makes what is
  /// chosen from it that of all, see Run::Part::range. @throws as SceneOptions::volume.
  void measure(const PictureOptions& picture, Run& run) const;
  /// Fills in the digests of the frames. `measure` comes first.
  void setDigests(Run& run);

  /// First and last of the whole turntable, of which `frames` may be a part.
  int first() const { return range_.first(); }
  int last() const { return range_.last(); }

  std::vector<TurntableFrame> frames;

 private:
  void checkSheets() const;
  void findVolumes(Run& run);
  std::vector<std::string> inputsOf(int frame) const;
  std::string filesKeyOf(int frame, Run& run) const;
  std::string volumeKeyOf(int frame, Run& run) const;
  bool volumeChanges() const;
  std::string digestWithout(const std::vector<std::string_view>& options, Run& run) const;

  const TurntableOptions& options_;
  FrameRange range_;
  /// Of every input; nothing where it is the same in all frames.
  std::vector<std::optional<FramePattern>> inputs_;
  /// The volume is another one in every frame, though its file may be the same.
  bool changesWithTime_ = false;
};

/// Makes the folders of all outputs, and finds out whether files can be written there.
/// @throws Error naming the path.
void prepareFolders(const TurntableOptions& options, const TurntablePlan& plan);

/// Marks as skipped what is there, is whole (readable to its last row), is a picture of `camera`'s size and
/// was made with the same options; notes what is there and is not.
void skipExisting(TurntablePlan& plan, const Camera& camera, const Run& run);

/// Makes the frames that are not skipped, one after another, each on all threads: frames side by side would
/// need the memory of as many pictures, and be no faster. Then makes the movie and the contact sheet, where
/// they are wanted, of all frames. A script is sampled anew for every camera that asks for other voxels, and
/// so is its light. Fills in the frames' seconds and the run's statistics.
void makeFrames(TurntablePlan& plan, const TurntableOptions& options, TurntableScene& scene,
                const Camera& start, LivePicture& live, Run& run);

}  // namespace nephele::apps
