#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/options/picture/scene_options.h"
#include "nephele/render/image/frame_range.h"
#include "nephele/render/image/movie.h"
#include "nephele/render/scene/turntable.h"

namespace nephele::apps {

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
  /// The files are there and whole, and are left as they are.
  bool skipped = false, previewSkipped = false;
  double seconds = 0;
  /// That it was made of.
  float voxelSize = 0;
};

/// What a call of the verb has to make.
struct TurntablePlan {
  /// First and last of the whole turntable, of which `frames` may be a part.
  int first = 0, last = 0;
  std::vector<TurntableFrame> frames;
  /// Says what frames are made of: the options that their pixels depend on, as typed, the contents of the
  /// files that these name, first and last, and the version of the program. The attribute kPartDigest of the
  /// frames.
  std::string digest;

  /// @throws CLI::ValidationError naming the option that is wrong.
  TurntablePlan(const TurntableOptions& options, Run& run);
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
void makeFrames(TurntablePlan& plan, const TurntableOptions& options, const PictureOptions& picture,
                SceneVolume& scene, const Camera& start, Run& run);

}  // namespace nephele::apps
