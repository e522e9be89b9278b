#include "nephele/render/session/picture_stages.h"

#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

// No key contains it, so that keys side by side cannot be mistaken for others.
constexpr char kBetween = '\n';

std::string joined(const std::string& before, const std::string& own) {
  return before + kBetween + own;
}

std::string volumeKey(const PictureStages::Keys& keys) {
  const std::string levels = keys.levels.empty() ? std::string() : joined(keys.shape, keys.levels);
  return joined(levels, keys.volume);
}

}  // namespace

std::shared_ptr<const Mesh> PictureStages::shape(const std::string& key, const std::function<Mesh()>& read) {
  if (!shape_.isAt(key)) {
    forgetLight();
    volume_.forget();
    levels_.forget();
  }
  return shape_.at(key, [&] { return std::make_shared<const Mesh>(read()); });
}

std::shared_ptr<const CloudLevels> PictureStages::levels(const std::string& key, const CloudOptions& options,
                                                         const std::vector<std::string>& layerKeys,
                                                         const Progress& progress) {
  require(shape_.kept() != nullptr, "PictureStages: levels need a shape");
  const std::string whole = joined(shape_.key(), key);
  if (!levels_.isAt(whole)) {
    forgetLight();
    volume_.forget();
  }
  return levels_.at(whole, [&] {
    layers_.expect({shape_.key(), layerKeys});
    return std::make_shared<const CloudLevels>(
        makeCloudLevels(*shape_.kept(), options, progress, layerKeys.empty() ? nullptr : &layers_));
  });
}

std::shared_ptr<const RenderVolume> PictureStages::volume(const std::string& key,
                                                          const std::function<RenderVolume()>& make) {
  const std::string whole = joined(levels_.key(), key);
  if (!volume_.isAt(whole)) {
    forgetLight();
  }
  return volume_.at(whole, [&] { return std::make_shared<const RenderVolume>(make()); });
}

std::shared_ptr<const RenderVolume> PictureStages::volume(const std::string& key,
                                                          std::shared_ptr<const RenderVolume> held) {
  const std::string whole = joined(levels_.key(), key);
  if (!volume_.isAt(whole)) forgetLight();
  return volume_.at(whole, [&] { return std::move(held); });
}

std::shared_ptr<const LitCloud> PictureStages::light(const std::string& mediumKey,
                                                     const std::string& lightsKey, const LightSetup& setup,
                                                     const Progress& progress) {
  require(volume_.kept() != nullptr, "PictureStages: light needs a volume");
  const std::string medium = joined(volume_.key(), mediumKey), whole = joined(medium, lightsKey);
  if (light_.isAt(whole)) return light_.kept();
  if (light_.kept()) left_ = light_.kept()->light;
  if (mediumKey_ != medium) left_.reset();
  picture_.forget();
  light_.forget();
  mediumKey_ = medium;
  const auto result = light_.at(whole, [&] {
    if (left_)
      left_->relight(setup.lights, progress);
    else
      left_.emplace(*volume_.kept(), setup.medium, setup.lights, setup.octaves, progress, setup.surfaces);
    return std::make_shared<const LitCloud>(LitCloud{volume_.kept(), *left_});
  });
  left_.reset();
  return result;
}

std::shared_ptr<const RenderResult> PictureStages::picture(const std::string& key, const Camera& camera,
                                                           const RenderOptions& options,
                                                           const Progress& progress) {
  require(light_.kept() != nullptr, "PictureStages: a picture needs light");
  return picture_.at(joined(light_.key(), key), [&] {
    return std::make_shared<const RenderResult>(light_.kept()->light.render(camera, options, progress));
  });
}

bool PictureStages::isLit(const Keys& keys) const {
  return light_.isAt(joined(joined(volumeKey(keys), keys.medium), keys.lights));
}

std::shared_ptr<const RenderVolume> PictureStages::volumeAt(const Keys& keys) const {
  return volume_.isAt(volumeKey(keys)) ? volume_.kept() : nullptr;
}

void PictureStages::forgetLight() {
  picture_.forget();
  light_.forget();
  left_.reset();
}

void PictureStages::forget() {
  forgetLight();
  volume_.forget();
  levels_.forget();
  layers_.forget();
  shape_.forget();
}

}  // namespace nephele
