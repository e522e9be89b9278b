// A font of strokes, drawn by hand for this file on a grid of units: capital letters are 7 high, small
// ones 5.
#include "nephele/render/image/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

constexpr double kCapital = 7, kGap = 2, kSpace = 3, kHalfStroke = 0.5;

struct Glyph {
  char sign;
  int width;
  /// Strokes, separated by spaces: '-' straight, '~' rounded, 'o' rounded and closed; then points, a digit
  /// for each of x and y. Letters stand on 2, small ones reach to 7, capital ones to 9.
  std::string_view strokes;
};

constexpr Glyph kUnknown{'?', 4, "-0242490902"};

constexpr Glyph kGlyphs[] = {
    {'0', 4, "o02424909"},
    {'1', 2, "-072922"},
    {'2', 4, "~070949462402 -0242"},
    {'3', 4, "~080949461626 ~264642020203"},
    {'4', 4, "-32390444"},
    {'5', 4, "-490906 ~060747420203"},
    {'6', 4, "~48390904 o02424606"},
    {'7', 4, "-094912"},
    {'8', 4, "o06464909 o02424606"},
    {'9', 4, "o05454909 ~47421203"},
    {'A', 4, "-022942 -1535"},
    {'B', 4, "-0209 ~09393606 ~06464202"},
    {'C', 4, "~483909023243"},
    {'D', 4, "-0902 ~09494202"},
    {'E', 4, "-49090242 -0636"},
    {'F', 4, "-490902 -0636"},
    {'G', 4, "~4839090242 -424525"},
    {'H', 4, "-0209 -4249 -0646"},
    {'I', 0, "-0209"},
    {'J', 3, "~39320204"},
    {'K', 4, "-0209 -4905 -1642"},
    {'L', 4, "-090242"},
    {'M', 6, "-0209346962"},
    {'N', 4, "-02094249"},
    {'O', 5, "o02525909"},
    {'P', 4, "-0209 ~09494505"},
    {'Q', 5, "o02525909 -3452"},
    {'R', 4, "-0209 ~09494505 -2542"},
    {'S', 4, "~4839090645421203"},
    {'T', 4, "-0949 -2922"},
    {'U', 4, "~09024249"},
    {'V', 4, "-092249"},
    {'W', 6, "-0912395269"},
    {'X', 4, "-0942 -0249"},
    {'Y', 4, "-092549 -2522"},
    {'Z', 4, "-09490242"},
    {'a', 4, "o02424707 -4742"},
    {'b', 4, "-0902 o02424707"},
    {'c', 4, "~463707023243"},
    {'d', 4, "-4942 o02424707"},
    {'e', 4, "-0545 ~454707023243"},
    {'f', 3, "~391912 -0727"},
    {'g', 4, "o02424707 ~47400001"},
    {'h', 4, "-0902 ~05074742"},
    {'i', 0, "-0702 -0909"},
    {'j', 2, "~272000 -2929"},
    {'k', 4, "-0902 -4704 -1542"},
    {'l', 1, "~090212"},
    {'m', 6, "-0702 ~05073732 ~35376762"},
    {'n', 4, "-0702 ~05074742"},
    {'o', 4, "o02424707"},
    {'p', 4, "-0700 o02424707"},
    {'q', 4, "-4740 o02424707"},
    {'r', 3, "-0702 ~050737"},
    {'s', 4, "~4637070544421203"},
    {'t', 3, "~191232 -0737"},
    {'u', 4, "~07024244 -4742"},
    {'v', 4, "-072247"},
    {'w', 6, "-0712375267"},
    {'x', 4, "-0742 -0247"},
    {'y', 4, "-0722 -4710"},
    {'z', 4, "-07470242"},
    {'.', 0, "-0202"},
    {',', 1, "-1201"},
    {':', 0, "-0303 -0707"},
    {';', 1, "-1707 -1201"},
    {'-', 3, "-0535"},
    {'+', 4, "-0545 -2723"},
    {'=', 4, "-0646 -0444"},
    {'/', 4, "-0149"},
    {'\\', 4, "-0941"},
    {'%', 6, "o07272909 o42626444 -1259"},
    {'(', 2, "~29070321"},
    {')', 2, "~09272301"},
    {'[', 2, "-29090121"},
    {']', 2, "-09292101"},
    {'#', 4, "-1219 -3239 -0444 -0747"},
    {'_', 4, "-0141"},
    {'|', 0, "-0901"},
    {'*', 4, "-2824 -0745 -0547"},
    {'!', 0, "-0904 -0202"},
    {'?', 4, "~080949462624 -2222"},
    {'<', 4, "-470542"},
    {'>', 4, "-074502"},
    {'\'', 0, "-0907"},
    {'"', 2, "-0907 -2927"},
    {'~', 4, "~0507254547"},
    {'@', 6, "o24444626 ~4643646909020252"},
};

const Glyph& glyphOf(char sign) {
  const auto* found = std::ranges::find(kGlyphs, sign, &Glyph::sign);
  return found == std::end(kGlyphs) ? kUnknown : *found;
}

struct Point {
  double x, y;
};
using Line = std::vector<Point>;

/// Cuts corners, Chaikin's way: towards a quadratic spline.
Line rounded(const Line& line, bool isClosed) {
  Line result;
  const std::size_t count = line.size(), edges = isClosed ? count : count - 1;
  if (!isClosed) result.push_back(line.front());
  for (std::size_t i = 0; i != edges; ++i) {
    const Point &a = line[i], &b = line[(i + 1) % count];
    for (const double t : {0.25, 0.75}) result.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
  }
  if (!isClosed) result.push_back(line.back());
  return result;
}

std::vector<Line> linesOf(const Glyph& glyph) {
  std::vector<Line> lines;
  for (std::size_t at = 0; at < glyph.strokes.size();) {
    const std::size_t end = std::min(glyph.strokes.find(' ', at), glyph.strokes.size());
    const std::string_view stroke = glyph.strokes.substr(at, end - at);
    Line line;
    for (std::size_t i = 1; i + 1 < stroke.size(); i += 2)
      line.push_back({double(stroke[i] - '0'), double(stroke[i + 1] - '0') - 2});
    const bool isClosed = stroke[0] == 'o';
    if (stroke[0] != '-')
      for (int round = 0; round != 4; ++round) line = rounded(line, isClosed);
    if (isClosed) line.push_back(line.front());
    lines.push_back(std::move(line));
    at = end + 1;
  }
  return lines;
}

double distance(const Point& p, const Point& a, const Point& b) {
  const double dx = b.x - a.x, dy = b.y - a.y, square = dx * dx + dy * dy;
  const double t = square > 0 ? std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / square, 0.0, 1.0) : 0.0;
  return std::hypot(p.x - a.x - t * dx, p.y - a.y - t * dy);
}

double distance(const Point& p, const std::vector<Line>& lines) {
  double nearest = HUGE_VAL;
  for (const Line& line : lines)
    for (std::size_t i = 0; i + 1 < line.size(); ++i)
      nearest = std::min(nearest, distance(p, line[i], line[i + 1]));
  return nearest;
}

}  // namespace

double textWidth(std::string_view text) {
  double width = 0;
  for (const char sign : text) width += sign == ' ' ? kSpace : glyphOf(sign).width + kGap;
  return std::max(width - kGap + 2 * kHalfStroke, 0.0) / kCapital;
}

void drawText(Image& image, std::string_view text, const TextPlace& place, const Vec3f& colour) {
  require(place.height > 0 && std::isfinite(place.height),
          fmt::format("text: expected a height above 0, got {}", place.height));
  const double unit = place.height / kCapital;
  std::vector<std::vector<float>*> channels;
  for (const char* name : {"R", "G", "B", "A"}) {
    static_cast<void>(image.channel(name));
    channels.push_back(&std::ranges::find(image.channels, name, &Image::Channel::name)->values);
  }
  const std::array<float, 4> inFront{colour.x, colour.y, colour.z, 1.0f};
  double x = place.x + kHalfStroke * unit;
  for (const char sign : text) {
    if (sign == ' ') {
      x += kSpace * unit;
      continue;
    }
    const Glyph& glyph = glyphOf(sign);
    const std::vector<Line> lines = linesOf(glyph);
    const int left = std::max(0, int(std::floor(x - unit))),
              right = std::min(image.width, int(std::ceil(x + (glyph.width + 1) * unit)) + 1),
              top = std::max(0, int(std::floor(place.baseline - (kCapital + 1) * unit))),
              bottom = std::min(image.height, int(std::ceil(place.baseline + 3 * unit)) + 1);
    for (int row = top; row < bottom; ++row)
      for (int column = left; column < right; ++column) {
        const Point p{(column + 0.5 - x) / unit, (place.baseline - row - 0.5) / unit};
        const auto cover = float(std::clamp((kHalfStroke - distance(p, lines)) * unit + 0.5, 0.0, 1.0));
        if (cover == 0) continue;
        const std::size_t pixel = std::size_t(row) * std::size_t(image.width) + std::size_t(column);
        for (std::size_t c = 0; c != channels.size(); ++c)
          (*channels[c])[pixel] = cover * inFront[c] + (1 - cover) * (*channels[c])[pixel];
      }
    x += (glyph.width + kGap) * unit;
  }
}

}  // namespace nephele
