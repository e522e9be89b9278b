#include "apps/look/shown.h"

#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

/// Opaque, of three channels, or of one in all three.
Image opaqueOf(const Image& image, const std::array<std::string, 3>& names) {
  Image result;
  result.width = image.width;
  result.height = image.height;
  constexpr const char* kColours[]{"R", "G", "B"};
  for (std::size_t c = 0; c < 3; ++c) result.add(kColours[c]).values = image.channel(names[c]).values;
  Image::Channel& alpha = result.add("A");
  std::ranges::fill(alpha.values, 1.0f);
  return result;
}

/// Near is bright; what is nowhere is black.
void depthsToGrey(Image& image) {
  float nearest = std::numeric_limits<float>::infinity(), farthest = -nearest;
  for (const float depth : image.channels[0].values)
    if (std::isfinite(depth)) {
      nearest = std::min(nearest, depth);
      farthest = std::max(farthest, depth);
    }
  const float span = std::max(farthest - nearest, 1e-12f);
  for (std::size_t c = 0; c < 3; ++c)
    for (float& depth : image.channels[c].values)
      depth = std::isfinite(depth) ? 1 - 0.85f * (depth - nearest) / span : 0.0f;
}

// From four stops below middle grey to five above.
constexpr int kLowestStop = -4;
constexpr std::array<Vec3f, 10> kStops{{{0.15f, 0.1f, 0.3f},
                                        {0.2f, 0.25f, 0.6f},
                                        {0.15f, 0.45f, 0.75f},
                                        {0.1f, 0.6f, 0.6f},
                                        {0.2f, 0.65f, 0.3f},
                                        {0.6f, 0.75f, 0.25f},
                                        {0.9f, 0.8f, 0.25f},
                                        {0.95f, 0.55f, 0.2f},
                                        {0.9f, 0.25f, 0.2f},
                                        {0.98f, 0.9f, 0.9f}}};

Image inFalseColours(const Image& image, const ViewTransform& view) {
  Image result = opaqueOf(image, {"R", "G", "B"});
  const float exposure = std::exp2(view.exposureStops);
  const Image::Channel* backdrop[3]{image.find("backdrop.R"), image.find("backdrop.G"),
                                    image.find("backdrop.B")};
  const Image::Channel& alpha = image.channel("A");
  for (std::size_t i = 0; i < alpha.values.size(); ++i) {
    const float behind[3]{view.background.x, view.background.y, view.background.z};
    float rgb[3];
    for (std::size_t c = 0; c < 3; ++c)
      rgb[c] = result.channels[c].values[i] +
               (1 - alpha.values[i]) * (backdrop[c] ? backdrop[c]->values[i] : behind[c]);
    const float luminance = exposure * (0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2]);
    const float stop = std::log2(std::max(luminance, 1e-9f) / 0.18f) - float(kLowestStop);
    const Vec3f& colour = kStops[std::size_t(std::clamp(int(std::lround(stop)), 0, int(kStops.size()) - 1))];
    result.channels[0].values[i] = colour.x;
    result.channels[1].values[i] = colour.y;
    result.channels[2].values[i] = colour.z;
  }
  return result;
}

struct Kind {
  std::string word, verb;
};

/// In the order of LookShow::What.
const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all{{"cloud", "cloud"}, {"surface", "cloud"}, {"checker", "cloud"},
                                     {"wisps", "wisps"}, {"pieces", "cut"},    {"transfer", "transfer"}};
  return all;
}

}  // namespace

const std::string& LookShow::word(What what) {
  return kinds()[std::size_t(what)].word;
}

std::optional<LookShow::What> LookShow::named(const std::string& word) {
  const auto found = std::ranges::find(kinds(), word, &Kind::word);
  if (found == kinds().end()) return std::nullopt;
  return What(found - kinds().begin());
}

std::string LookShow::verb(What what) {
  return kinds()[std::size_t(what)].verb;
}

std::vector<std::string> LookShow::layers() const {
  if (layer == "depth") return {"Z"};
  if (layer == "normal" || layer == "transmittance" || layer == "albedo") return {layer};
  if (layer.starts_with("light_")) return {"light"};
  return {};
}

std::string jpegOf(const std::vector<std::uint8_t>& rgb, int width, int height, int quality) {
  const std::unique_ptr<void, int (*)(tjhandle)> coder(tjInitCompress(), tjDestroy);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool isDone = coder && tjCompress2(coder.get(), rgb.data(), width, 0, height, TJPF_RGB, &bytes, &size,
                                           TJSAMP_444, quality, TJFLAG_FASTDCT) == 0;
  std::string result(reinterpret_cast<const char*>(bytes), isDone ? size : 0);
  tjFree(bytes);
  require(isDone, "the picture could not be coded as JPEG");
  return result;
}

std::string shownJpeg(const Image& image, const LookShow& show, const ViewTransform& view, int quality) {
  ViewTransform plain;
  plain.curve = ViewCurve::raw;
  const auto coded = [&](const Image& shown, const ViewTransform& through) {
    return jpegOf(screenBytes(shown, through), shown.width, shown.height, quality);
  };
  if (show.falseColor && show.layer == "beauty") return coded(inFalseColours(image, view), plain);
  if (show.layer == "beauty" || !show.isVolume()) return coded(image, view);
  if (show.layer == "depth") {
    Image depths = opaqueOf(image, {"Z", "Z", "Z"});
    depthsToGrey(depths);
    return coded(depths, plain);
  }
  if (show.layer == "normal") {
    Image normals = opaqueOf(image, {"N.X", "N.Y", "N.Z"});
    for (std::size_t c = 0; c < 3; ++c)
      for (float& value : normals.channels[c].values) value = 0.5f + 0.5f * value;
    return coded(normals, plain);
  }
  const bool isLight = show.layer.starts_with("light_");
  require(!isLight || image.find(show.layer + ".R"),
          "layer: got '" + show.layer + "', and no light has this name");
  const Image layer = opaqueOf(image, {show.layer + ".R", show.layer + ".G", show.layer + ".B"});
  return coded(layer, isLight ? view : plain);
}

}  // namespace nephele::apps
