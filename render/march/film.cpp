#include "nephele/render/march/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"

namespace nephele {

const std::vector<std::string>& Film::layerNames() {
  static const std::vector<std::string> names{"Z",      "Z_median", "Z_mean",        "normal", "position",
                                              "motion", "light",    "transmittance", "albedo", "emission"};
  return names;
}

std::size_t Film::channelCount(const std::vector<std::string>& layers, std::size_t lightCount) {
  std::size_t count = 4;
  for (const std::string& layer : layers)
    count += layer == "light" ? 3 * lightCount : layer == "motion" ? 2 : layer.starts_with("Z") ? 1 : 3;
  return count;
}

Film::Film(const Camera& camera, const std::vector<std::string>& lights,
           const std::vector<std::string>& layers)
    : Film(camera.window(), camera.picture(), lights, layers) {}

Film::Film(const PixelBox& window, const PixelBox& picture, const std::vector<std::string>& lights,
           const std::vector<std::string>& layers)
    : window_(window), picture_(picture), lights_(lights), layers_(layers) {
  image_.setWindow(window, picture.width(), picture.height());
  for (const char* name : {"R", "G", "B", "A"}) image_.add(name);
  const std::vector<std::string> colours{"R", "G", "B"}, axes{"X", "Y", "Z"};
  for (const std::string& layer : layers) {
    if (layer == "Z") {
      depth_ = addLayer(layer, {});
    } else if (layer == "Z_median") {
      medianDepth_ = addLayer(layer, {});
    } else if (layer == "Z_mean") {
      meanDepth_ = addLayer(layer, {});
    } else if (layer == "normal") {
      normal_ = addLayer("N", axes);
    } else if (layer == "position") {
      position_ = addLayer("P", axes);
    } else if (layer == "motion") {
      motion_ = addLayer("motion", {"X", "Y"});
    } else if (layer == "transmittance") {
      transmittance_ = addLayer(layer, colours);
    } else if (layer == "albedo") {
      albedo_ = addLayer(layer, colours);
    } else if (layer == "emission") {
      emission_ = addLayer(layer, colours);
    } else if (layer == "light") {
      light_ = int(image_.channels.size());
      for (const std::string& light : lights) addLayer("light_" + light, colours);
    } else {
      std::string names;
      for (const std::string& name : layerNames()) names += (names.empty() ? "" : ", ") + name;
      throw Error(fmt::format("aov: expected one of {}, got '{}'", names, printable(layer, 60)));
    }
  }
}

Film::Film(const RenderScene& scene, const FilmOptions& options)
    : Film(scene.camera, scene.lightNames(), options.aovs) {
  options_ = options;
  require(options.adaptiveThreshold >= 0 && options.adaptiveThreshold <= 1,
          fmt::format("adaptive threshold: expected 0 to 1, got {}", options.adaptiveThreshold));
  require(!(options.adaptiveThreshold > 0 && options.deep),
          "adaptive threshold: deep pictures need every pixel to be marched");
  if (options.deep)
    deep_ = DeepImage{image_.width, image_.height, image_.display,
                      std::vector<std::vector<DeepSample>>(image_.channels.front().values.size())};
}

PixelBox Film::reach() const {
  if (options_.adaptiveThreshold == 0) return window_;
  return window_.grownBy(reachOf(kFirstApart)).sharedWith(picture_);
}

Film Film::part(const PixelBox& window) const {
  Film part(window, picture_, lights_, layers_);
  part.options_ = options_;
  return part;
}

void Film::take(const Film& part) {
  const PixelBox both = window_.sharedWith(part.window_);
  for (std::size_t c = 0; c != image_.channels.size(); ++c)
    for (int y = both.y0; y < both.y1; ++y) {
      const float* from = part.image_.channels[c].values.data();
      std::copy(from + part.placeOf(both.x0, y), from + part.placeOf(both.x0, y) + both.width(),
                image_.channels[c].values.data() + placeOf(both.x0, y));
    }
}

int Film::addLayer(const std::string& name, const std::vector<std::string>& parts) {
  const int first = int(image_.channels.size());
  const auto add = [&](const std::string& channel) {
    require(!image_.find(channel), fmt::format("aov: {} is named twice", channel));
    image_.add(channel, false);
  };
  if (parts.empty()) add(name);
  for (const std::string& part : parts) add(name + "." + part);
  return first;
}

void Film::setColour(int channel, std::size_t at, const Vec3f& colour) {
  if (channel >= 0)
    for (int c = 0; c != 3; ++c) value(channel + c, at) = colour[c];
}

void Film::set(std::size_t at, const PixelSum& pixel) {
  Vec3f colour = pixel.emission;
  for (std::size_t i = 0; i != lights_.size(); ++i) colour += pixel.light[i];
  setColour(0, at, colour);
  value(3, at) = pixel.alpha;
  setColour(transmittance_, at, Vec3f{1, 1, 1} - pixel.opacity);
  setColour(albedo_, at, pixel.albedo);
  setColour(emission_, at, pixel.emission);
  if (light_ >= 0)
    for (std::size_t i = 0; i != lights_.size(); ++i) setColour(light_ + int(i) * 3, at, pixel.light[i]);
  if (depth_ >= 0) value(depth_, at) = pixel.depth;
}

void Film::setMeans(int first, int count, std::size_t at, const std::array<std::size_t, 4>& from) {
  for (int channel = first; channel != first + count; ++channel)
    value(channel, at) = 0.25f * (value(channel, from[0]) + value(channel, from[1]) +
                                  value(channel, from[2]) + value(channel, from[3]));
}

bool Film::interpolate(std::size_t at, const std::array<std::size_t, 4>& from, float threshold, float faint) {
  for (int channel = 0; channel != 4; ++channel) {
    const auto [least, most] = std::minmax(
        {value(channel, from[0]), value(channel, from[1]), value(channel, from[2]), value(channel, from[3])});
    if (!(most - least <= threshold * (channel == 3 ? 1.0f : std::max(most, faint)))) return false;
  }
  if (depth_ >= 0) {
    const auto [near, far] = std::minmax(
        {value(depth_, from[0]), value(depth_, from[1]), value(depth_, from[2]), value(depth_, from[3])});
    // Infinite where a ray meets nothing.
    if (std::isinf(near) != std::isinf(far)) return false;
    value(depth_, at) = near;
  }
  setMeans(0, 4, at, from);
  for (const int layer : {transmittance_, albedo_, emission_})
    if (layer >= 0) setMeans(layer, 3, at, from);
  if (light_ >= 0) setMeans(light_, 3 * int(lights_.size()), at, from);
  return true;
}

void Film::set(std::size_t at, const PixelPoint& point) {
  if (medianDepth_ >= 0) value(medianDepth_, at) = point.medianDepth;
  if (meanDepth_ >= 0) value(meanDepth_, at) = point.meanDepth;
  setColour(normal_, at, point.normal);
  setColour(position_, at, point.position);
  if (motion_ >= 0)
    for (int axis = 0; axis != 2; ++axis) value(motion_ + axis, at) = point.motion[axis];
}

}  // namespace nephele
