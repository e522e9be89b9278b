#include "nephele/render/image/contact_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/render/image/text.h"

namespace nephele {
namespace {

// The columns that make a sheet of `count` cells of `aspect` (width / height) most like 16:9, empty places
// counted against it.
int bestColumns(int count, double aspect) {
  int best = 1;
  double bestCost = HUGE_VAL;
  for (int columns = 1; columns <= count; ++columns) {
    const int rows = (count + columns - 1) / columns;
    const double shape = std::fabs(std::log(columns * aspect / rows * 9 / 16));
    const double cost = shape + 2.0 * (columns * rows - count) / (columns * rows);
    if (cost < bestCost) {
      bestCost = cost;
      best = columns;
    }
  }
  return best;
}

// What output pixel `i` of `to` covers of `from` pixels.
struct Cover {
  int begin, end;
  double start, stop;

  Cover(int i, int from, int to) : start(double(i) * from / to), stop((i + 1.0) * from / to) {
    begin = int(start);
    end = std::min(from, int(std::ceil(stop)));
  }
  double share(int pixel) const {
    return (std::min(stop, pixel + 1.0) - std::max(start, double(pixel))) / (stop - start);
  }
};

constexpr const char* kNames[] = {"R", "G", "B", "A"};

// R, G, B and A of an opaque picture.
std::array<std::vector<float>, 4> inFrontOfBackdrop(const Image& frame) {
  const std::vector<float>& alpha = frame.channel("A").values;
  std::array<std::vector<float>, 4> result;
  for (std::size_t c = 0; c != 3; ++c) {
    const std::vector<float>& behind = frame.channel(std::string("backdrop.") + kNames[c]).values;
    result[c] = frame.channel(kNames[c]).values;
    for (std::size_t i = 0; i != alpha.size(); ++i) result[c][i] += (1 - alpha[i]) * behind[i];
  }
  result[3].assign(alpha.size(), 1.0f);
  return result;
}

}  // namespace

ContactSheet::ContactSheet(int frameCount, int frameWidth, int frameHeight,
                           const ContactSheetOptions& options)
    : frameWidth_(frameWidth), frameHeight_(frameHeight), gap_(options.gap) {
  require(
      frameCount >= 1 && frameWidth >= 1 && frameHeight >= 1,
      fmt::format("contact sheet: expected frames, got {} of {}x{}", frameCount, frameWidth, frameHeight));
  require(options.width >= 1 && options.gap >= 0 && options.mostFrames >= 1,
          "contact sheet: expected a width and a number of frames of at least 1, and a gap of at least 0");
  const int count = std::min(frameCount, options.mostFrames);
  for (int i = 0; i != count; ++i) shown_.push_back(int((long long)(i)*frameCount / count));

  const double aspect = double(frameWidth) / frameHeight;
  require(options.labels.empty() || options.labels.size() == std::size_t(frameCount),
          fmt::format("contact sheet: expected {} labels, got {}", frameCount, options.labels.size()));
  require(!options.columns || *options.columns >= 1, "contact sheet: expected a column at least");
  columns_ = options.columns.value_or(bestColumns(count, aspect));
  cellWidth_ = std::clamp((options.width - gap_ * (columns_ + 1)) / columns_, 1, frameWidth);
  cellHeight_ = std::max(1, int(std::lround(cellWidth_ / aspect)));
  image_.width = columns_ * cellWidth_ + gap_ * (columns_ + 1);
  // A band below each frame, of which letters take half.
  if (!options.labels.empty()) labelHeight_ = std::clamp(cellWidth_ / 16, 14, 40);
  image_.height = rows() * (cellHeight_ + labelHeight_) + gap_ * (rows() + 1);
  for (const char* name : kNames) image_.add(name);
  std::ranges::fill(image_.channels[3].values, 1.0f);
  for (std::size_t i = 0; i != shown_.size() && labelHeight_ > 0; ++i)
    drawLabel(int(i), options.labels[std::size_t(shown_[i])]);
}

void ContactSheet::drawLabel(int place, const std::string& label) {
  const double width = textWidth(label), height = std::min(0.45 * labelHeight_, 0.95 * cellWidth_ / width);
  const double x = left(place) + (cellWidth_ - width * height) / 2,
               baseline = top(place) + cellHeight_ + (labelHeight_ + height) / 2;
  if (width > 0) drawText(image_, label, {x, baseline, height}, {0.6f, 0.6f, 0.6f});
}

void ContactSheet::set(int place, const Image& frame) {
  require(place >= 0 && place < int(shown_.size()),
          fmt::format("contact sheet: expected a place below {}, got {}", shown_.size(), place));
  require(frame.width == frameWidth_ && frame.height == frameHeight_,
          fmt::format("contact sheet: expected a frame of {}x{}, got {}x{}", frameWidth_, frameHeight_,
                      frame.width, frame.height));
  frame.check();
  std::array<std::vector<float>, 4> inFront;
  const bool hasBackdrop = frame.find("backdrop.R") && frame.find("backdrop.G") && frame.find("backdrop.B");
  if (hasBackdrop) inFront = inFrontOfBackdrop(frame);
  for (std::size_t c = 0; c != std::size(kNames); ++c) {
    const std::vector<float>& from = hasBackdrop ? inFront[c] : frame.channel(kNames[c]).values;
    for (int y = 0; y != cellHeight_; ++y) {
      const Cover rows(y, frameHeight_, cellHeight_);
      for (int x = 0; x != cellWidth_; ++x) {
        const Cover columns(x, frameWidth_, cellWidth_);
        double sum = 0;
        for (int v = rows.begin; v != rows.end; ++v)
          for (int u = columns.begin; u != columns.end; ++u)
            sum += rows.share(v) * columns.share(u) * double(from[std::size_t(v) * frameWidth_ + u]);
        image_.channels[c].values[std::size_t(top(place) + y) * image_.width + left(place) + x] = float(sum);
      }
    }
  }
}

}  // namespace nephele
