#include "apps/felt/field_drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace nephele::apps {
namespace {

constexpr int kColumns = 64, kRows = 12;
/// A Braille letter has two columns of four dots.
constexpr int kDotsAcross = 2, kDotsDown = 4;

struct Range {
  float low = std::numeric_limits<float>::infinity(), high = -low;

  explicit Range(const std::vector<float>& values) {
    for (const float value : values)
      if (std::isfinite(value)) {
        low = std::min(low, value);
        high = std::max(high, value);
      }
  }
  bool isEmpty() const { return low > high; }
  /// 0 at the lowest, 1 at the highest; 0.5 where all are equal.
  float share(float value) const { return high > low ? (value - low) / (high - low) : 0.5f; }
};

/// Values at points that `place` gives by their number.
template <class Place>
std::vector<float> valuesAt(const ScalarField& field, std::size_t count, const Place& place) {
  std::vector<float> x(count), y(count), z(count), values(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3f point = place(i);
    x[i] = point.x;
    y[i] = point.y;
    z[i] = point.z;
  }
  field.eval({x, y, z}, values);
  return values;
}

std::string utf8(int code) {
  return {char(0xE0 | code >> 12), char(0x80 | (code >> 6 & 0x3F)), char(0x80 | (code & 0x3F))};
}

/// Values of the middles of `width` x `height` rectangles of a slice, rows from the top.
std::vector<float> sampledSlice(const ScalarField& field, const Slice& slice, int width, int height) {
  const Vec3f low = slice.box.min, size = slice.box.max - slice.box.min;
  const auto place = [&](std::size_t i) {
    const float across = (float(i % width) + 0.5f) / float(width),
                down = (float(i / width) + 0.5f) / float(height);
    Vec3f point{};
    point[slice.axis] = slice.place;
    point[slice.right()] = low[slice.right()] + across * size[slice.right()];
    point[slice.up()] = low[slice.up()] + (1 - down) * size[slice.up()];
    return point;
  };
  return valuesAt(field, std::size_t(width) * height, place);
}

/// Height over width of a slice.
float aspect(const Slice& slice) {
  const Vec3f size = slice.box.max - slice.box.min;
  return size[slice.up()] / size[slice.right()];
}

}  // namespace

std::vector<std::string> plotted(const ScalarField& field, const Vec3f& a, const Vec3f& b) {
  constexpr int kAcross = kColumns * kDotsAcross, kDown = kRows * kDotsDown;
  const std::vector<float> values =
      valuesAt(field, kAcross, [&](std::size_t i) { return a + (float(i) / float(kAcross - 1)) * (b - a); });
  const Range range(values);
  if (range.isEmpty()) return {"no value on this line is finite"};

  std::vector<int> dots(kColumns * kRows);
  // Which bit of a letter is which dot, by row and column.
  constexpr int kBits[kDotsDown][kDotsAcross] = {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};
  const auto rowOf = [&](float value) {
    return std::clamp(int(std::lround((1 - range.share(value)) * float(kDown - 1))), 0, kDown - 1);
  };
  const auto mark = [&](int column, int row) {
    dots[row / kDotsDown * kColumns + column / kDotsAcross] |= kBits[row % kDotsDown][column % kDotsAcross];
  };
  int before = -1;
  for (int i = 0; i < kAcross; ++i) {
    if (!std::isfinite(values[i])) {
      before = -1;
      continue;
    }
    const int row = rowOf(values[i]);
    // Steep parts stay joined.
    const int from = before < 0 ? row : before < row ? before + 1 : before > row ? before - 1 : row;
    for (int r = std::min(from, row); r <= std::max(from, row); ++r) mark(i, r);
    before = row;
  }
  const bool crossesZero = range.low < 0 && range.high > 0;
  if (crossesZero)
    for (int i = 0; i < kAcross; i += 4) mark(i, rowOf(0));

  std::vector<std::string> lines;
  for (int row = 0; row < kRows; ++row) {
    std::string label;
    if (row == 0)
      label = fmt::format("{:.4g}", range.high);
    else if (row == kRows - 1)
      label = fmt::format("{:.4g}", range.low);
    else if (crossesZero && row == rowOf(0) / kDotsDown)
      label = "0";
    std::string line = fmt::format("{:>10} ", label);
    for (int column = 0; column < kColumns; ++column) line += utf8(0x2800 + dots[row * kColumns + column]);
    lines.push_back(line);
  }
  const auto ends = [](const Vec3f& p) { return fmt::format("({:g}, {:g}, {:g})", p.x, p.y, p.z); };
  lines.push_back(fmt::format("{:>10} {}{:>{}}", "", ends(a), ends(b), kColumns - int(ends(a).size())));
  return lines;
}

std::vector<std::string> drawn(const ScalarField& field, const Slice& slice) {
  static const std::vector<std::string> marks{" ", "·", ":", "-", "=", "+", "*", "#", "%", "@"};
  // A letter is twice as high as it is wide.
  const int rows = std::clamp(int(std::lround(0.5f * kColumns * aspect(slice))), 1, 48);
  const std::vector<float> values = sampledSlice(field, slice, kColumns, rows);
  const Range range(values);
  if (range.isEmpty()) return {"no value on this plane is finite"};
  std::vector<std::string> lines;
  for (int row = 0; row < rows; ++row) {
    std::string line = "  ";
    for (int column = 0; column < kColumns; ++column) {
      const float value = values[row * kColumns + column];
      line += std::isfinite(value) ? marks[std::size_t(range.share(value) * 9.0f)] : "?";
    }
    lines.push_back(line);
  }
  constexpr const char* kNames = "xyz";
  lines.push_back(fmt::format("  {} = {:g}, {} to the right, {} up, ' ' {:.4g} to '@' {:.4g}",
                              kNames[slice.axis], slice.place, kNames[slice.right()], kNames[slice.up()],
                              range.low, range.high));
  return lines;
}

Image pictureOf(const ScalarField& field, const Slice& slice, int pixels) {
  const float ratio = aspect(slice);
  Image image;
  image.width = ratio > 1 ? std::max(1, int(std::lround(float(pixels) / ratio))) : pixels;
  image.height = ratio > 1 ? pixels : std::max(1, int(std::lround(float(pixels) * ratio)));
  const std::vector<float> values = sampledSlice(field, slice, image.width, image.height);
  const Range range(values);
  const float high = std::max(range.high, 0.0f), low = std::min(range.low, 0.0f);
  // What is below 0 is seen as cold, from a pale edge to a deep blue.
  constexpr Vec3f kEdge{0.45f, 0.6f, 0.75f}, kDeep{0.02f, 0.05f, 0.14f}, kHole{0.5f, 0.0f, 0.0f};
  for (const char* name : {"R", "G", "B", "A"}) image.add(name);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float value = values[i];
    Vec3f color = kHole;
    if (value >= 0 && std::isfinite(value)) {
      const float grey = high > 0 ? value / high : 0.0f;
      color = {grey, grey, grey};
    } else if (std::isfinite(value)) {
      color = kEdge + std::sqrt(value / low) * (kDeep - kEdge);
    }
    for (int c = 0; c < 3; ++c) image.channels[c].values[i] = color[c];
    image.channels[3].values[i] = 1;
  }
  return image;
}

}  // namespace nephele::apps
