#pragma once

#include <vector>

#include "nephele/render/image/image.h"

namespace nephele {

struct ContactSheetOptions {
  /// Pixels across, at most.
  int width = 1920;
  /// Pixels between frames.
  int gap = 4;
  /// Of more frames, this many evenly spread ones are shown.
  int mostFrames = 100;
};

/// Small copies of the frames of a sequence on one picture, in rows from the upper left.
class ContactSheet {
 public:
  /// For `frameCount` frames of one size. Columns are chosen so that the sheet is about as wide as 16:9 and
  /// few places stay empty. @throws Error if a number is below 1 (the gap: below 0).
  ContactSheet(int frameCount, int frameWidth, int frameHeight, const ContactSheetOptions& options = {});

  /// Which frames are shown, in order, as numbers from 0 to frameCount - 1.
  const std::vector<int>& shown() const { return shown_; }
  int columns() const { return columns_; }
  int rows() const { return (int(shown_.size()) + columns_ - 1) / columns_; }

  /// Puts a frame at its `place`, an index into shown(): every pixel of the sheet is the mean of those that
  /// it covers, in linear light; where the frame has a layer `backdrop`, of the frame in front of it.
  /// @throws Error if the frame has another size or lacks R, G, B or A.
  void set(int place, const Image& frame);

  /// R, G, B and A, premultiplied; black and opaque between frames.
  const Image& image() const { return image_; }

 private:
  int frameWidth_, frameHeight_, gap_;
  int columns_ = 1, cellWidth_ = 1, cellHeight_ = 1;
  std::vector<int> shown_;
  Image image_;
};

}  // namespace nephele
