#pragma once

#include <string>
#include <vector>

namespace nephele {

/// Frames as typed: "1-48", "1001-1100x2,1150". A range is FIRST-LAST, or FIRST-LASTxSTEP, or one frame;
/// several are separated by commas.
class FrameRange {
 public:
  /// Most frames that a range may have.
  static constexpr int kMost = 1000000;
  /// Largest frame number.
  static constexpr int kLast = 99999999;

  /// @throws Error naming the part of `text` that is wrong: not of these forms, running backwards, a step of
  /// 0, a number beyond 0 .. kLast, or more than kMost frames.
  static FrameRange parse(const std::string& text);

  /// In order, every frame once. Never empty.
  const std::vector<int>& frames() const { return frames_; }
  bool contains(int frame) const;

  /// Smallest and largest number that was typed: 1 and 48 of "1-48x5", whose last frame is 46.
  int first() const { return first_; }
  int last() const { return last_; }

  /// Every `count`-th frame from the `index`-th on, `index` counted from 1: together the `count` shards are
  /// all frames, each once. Empty where there are fewer frames than `index`.
  /// @throws Error unless 1 <= index <= count.
  std::vector<int> shard(int index, int count) const;

 private:
  std::vector<int> frames_;
  int first_ = 0, last_ = 0;
};

/// A file name with a place for the frame number: "cloud.####.exr", "cloud.%04d.exr" or "cloud.$F4.exr".
///
/// Numbers are filled up with zeros to the width that the place says (####, %04d and $F4: 4; %d and $F:
/// none); longer ones are written whole.
class FramePattern {
 public:
  /// @throws Error unless the file name of `text` has one such place; folders are taken as they are.
  static FramePattern parse(const std::string& text);
  /// How many such places the file name of `text` has.
  static int places(const std::string& text);

  std::string path(int frame) const;
  /// The name of another sequence, with `words` before the number: cloud.words.####.exr of cloud.####.exr.
  std::string withWords(const std::string& words) const;
  /// The folder of all frames, "." if none was given.
  std::string folder() const;
  const std::string& text() const { return text_; }

 private:
  std::string text_, before_, after_;
  int width_ = 0;
};

}  // namespace nephele
