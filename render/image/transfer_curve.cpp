// Curves between the numbers of picture files and light.
//
// An ICC profile is a table of tags: a signature, an offset and a size each, big-endian. The curves of matrix
// profiles are rTRC, gTRC and bTRC, that of grey ones kTRC.
#include "nephele/render/image/transfer_curve.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string_view>

namespace nephele {

namespace {

using Bytes = std::span<const std::uint8_t>;

std::uint32_t wordAt(Bytes bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i != 4; ++i) word = word << 8 | bytes[at + i];
  return word;
}

std::uint32_t shortAt(Bytes bytes, std::size_t at) {
  return std::uint32_t(bytes[at]) << 8 | bytes[at + 1];
}

double fixedAt(Bytes bytes, std::size_t at) {
  return double(std::int32_t(wordAt(bytes, at))) / 65536;
}

bool saysAt(Bytes bytes, std::size_t at, std::string_view signature) {
  return std::equal(signature.begin(), signature.end(), bytes.begin() + std::ptrdiff_t(at),
                    [](char a, std::uint8_t b) { return std::uint8_t(a) == b; });
}

// The bytes of a tag; none where it is missing or reaches beyond the profile.
Bytes tagOf(Bytes profile, std::string_view signature) {
  constexpr std::size_t kTable = 128;
  if (profile.size() < kTable + 4) return {};
  const std::size_t count = wordAt(profile, kTable);
  for (std::size_t i = 0, at = kTable + 4; i != count && at + 12 <= profile.size(); ++i, at += 12) {
    if (!saysAt(profile, at, signature)) continue;
    const std::size_t begin = wordAt(profile, at + 4), size = wordAt(profile, at + 8);
    if (begin > profile.size() || size > profile.size() - begin) return {};
    return profile.subspan(begin, size);
  }
  return {};
}

}  // namespace

TransferCurve TransferCurve::srgb() {
  TransferCurve curve;
  curve.exponent_ = 2.4;
  curve.scale_ = 1 / 1.055;
  curve.offset_ = 0.055 / 1.055;
  curve.slope_ = 1 / 12.92;
  curve.start_ = 0.04045;
  return curve;
}

TransferCurve TransferCurve::power(float exponent) {
  TransferCurve curve;
  curve.exponent_ = double(exponent);
  return curve;
}

std::optional<TransferCurve> TransferCurve::parse(Bytes bytes) {
  if (bytes.size() < 12) return std::nullopt;
  TransferCurve curve;
  if (saysAt(bytes, 0, "curv")) {
    const std::size_t count = wordAt(bytes, 8);
    if (count > (bytes.size() - 12) / 2) return std::nullopt;
    if (count == 1) curve.exponent_ = double(shortAt(bytes, 12)) / 256;
    if (count > 1)
      for (std::size_t i = 0; i != count; ++i)
        curve.table_.push_back(float(shortAt(bytes, 12 + 2 * i)) / 65535.0f);
    return curve;
  }
  if (!saysAt(bytes, 0, "para")) return std::nullopt;
  // How many numbers each kind has, of: exponent, scale, offset, slope, start, added, added below.
  constexpr std::size_t kCounts[] = {1, 3, 4, 5, 7};
  const std::size_t kind = shortAt(bytes, 8);
  if (kind >= std::size(kCounts) || bytes.size() < 12 + 4 * kCounts[kind]) return std::nullopt;
  const auto number = [&](std::size_t i) { return fixedAt(bytes, 12 + 4 * i); };
  curve.exponent_ = number(0);
  if (kind == 0) return curve;
  curve.scale_ = number(1);
  curve.offset_ = number(2);
  if (kind >= 3) {
    curve.slope_ = number(3);
    curve.start_ = number(4);
    if (kind == 4) curve.added_ = number(5), curve.addedBelow_ = number(6);
    return curve;
  }
  if (curve.scale_ == 0) return std::nullopt;
  curve.start_ = -curve.offset_ / curve.scale_;
  if (kind == 2) curve.added_ = curve.addedBelow_ = number(3);
  return curve;
}

std::optional<std::array<TransferCurve, 3>> TransferCurve::ofProfile(Bytes profile) {
  const bool isGrey = !tagOf(profile, "kTRC").empty();
  std::array<TransferCurve, 3> curves;
  constexpr std::string_view kColours[] = {"rTRC", "gTRC", "bTRC"};
  for (std::size_t c = 0; c != 3; ++c) {
    const auto curve = parse(tagOf(profile, isGrey ? "kTRC" : kColours[c]));
    if (!curve) return std::nullopt;
    curves[c] = *curve;
  }
  return curves;
}

float TransferCurve::operator()(float x) const {
  if (!table_.empty()) {
    const float place = (x > 0 ? std::min(x, 1.0f) : 0.0f) * float(table_.size() - 1);
    const std::size_t before = std::min(std::size_t(place), table_.size() - 2);
    return table_[before] + (table_[before + 1] - table_[before]) * (place - float(before));
  }
  if (exponent_ == 1 && scale_ == 1 && offset_ == 0 && added_ == 0 && start_ == 0) return x;
  if (double(x) < start_) {
    if (slope_ != 0 || addedBelow_ != 0 || x >= 0) return float(slope_ * double(x) + addedBelow_);
    return -(*this)(-x);
  }
  const double base = scale_ * double(x) + offset_;
  return float((base < 0 ? -std::pow(-base, exponent_) : std::pow(base, exponent_)) + added_);
}

}  // namespace nephele
