#pragma once

#include <optional>
#include <string>
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
  /// Frames in a row; chosen if not given.
  std::optional<int> columns{};
  /// A line of text below each frame, in the order of the frames; none if empty.
  std::vector<std::string> labels{};
};

/// Small copies of the frames of a sequence on one picture, in rows from the upper left.
class ContactSheet {
 public:
  /// For `frameCount` frames of one size. Columns are chosen so that the sheet is about as wide as 16:9 and
  /// few places stay empty, unless they are given. @throws Error if a number is below 1 (the gap: below 0),
  /// or there are not as many labels as frames.
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
  int left(int place) const { return gap_ + place % columns_ * (cellWidth_ + gap_); }
  int top(int place) const { return gap_ + place / columns_ * (cellHeight_ + labelHeight_ + gap_); }
  void drawLabel(int place, const std::string& label);

  int frameWidth_, frameHeight_, gap_;
  int columns_ = 1, cellWidth_ = 1, cellHeight_ = 1, labelHeight_ = 0;
  std::vector<int> shown_;
  Image image_;
};

}  // namespace nephele
