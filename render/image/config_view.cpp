// Views of OpenColorIO configurations.
#include "nephele/render/image/config_view.h"

#include <OpenColorIO/OpenColorIO.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/base/text_file.h"
#include "nephele/render/image/detail/config_check.h"

namespace nephele {
namespace {

namespace OCIO = OCIO_NAMESPACE;

// OpenColorIO reports on stderr what it then throws as well.
class Silence {
 public:
  Silence() : before_(OCIO::GetLoggingLevel()) { OCIO::SetLoggingLevel(OCIO::LOGGING_LEVEL_NONE); }
  ~Silence() { OCIO::SetLoggingLevel(before_); }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  OCIO::LoggingLevel before_;
};

// What OpenColorIO says, on one line and without the words of the libraries that it reads with.
std::string reasonOf(const std::string& path, std::string message) {
  std::ranges::replace(message, '\n', ' ');
  for (const std::string& words :
       {fmt::format("Error: Loading the OCIO profile '{}' failed. ", path), std::string("yaml-cpp: ")})
    if (const std::size_t at = message.find(words); at != message.npos) message.erase(at, words.size());
  return message == "stoi" ? "ocio_profile_version is no number" : message;
}

using Views = std::vector<std::pair<std::string, std::string>>;

// Displays and views, those of the default display first.
Views viewsOf(const OCIO::ConstConfigRcPtr& config) {
  Views views;
  const std::string standard = config->getDefaultDisplay();
  std::vector<std::string> displays;
  for (int i = 0; i != config->getNumDisplays(); ++i) displays.emplace_back(config->getDisplay(i));
  // clang 14 does not take the ranges' own stable_partition of this standard library.
  std::stable_partition(displays.begin(), displays.end(),
                        [&](const std::string& display) { return display == standard; });
  for (const std::string& display : displays)
    for (int i = 0; i != config->getNumViews(display.c_str()); ++i)
      views.emplace_back(display, config->getView(display.c_str(), i));
  return views;
}

std::string listed(const Views& views) {
  constexpr std::size_t kMost = 60;
  std::string text;
  for (std::size_t i = 0; i != std::min(views.size(), kMost); ++i)
    text += fmt::format("{}{}/{}", i == 0 ? "" : ", ", printable(views[i].first, 60),
                        printable(views[i].second, 60));
  return views.size() > kMost ? fmt::format("{} and {} more", text, views.size() - kMost) : text;
}

std::pair<std::string, std::string> chosen(const OCIO::ConstConfigRcPtr& config, const std::string& wanted) {
  const Views views = viewsOf(config);
  require(!views.empty(), "has no views");
  const std::string standard = config->getDefaultDisplay();
  if (wanted.empty()) return {standard, config->getDefaultView(standard.c_str())};
  // Names may have a slash of their own.
  for (const auto& view : views)
    if (view.first + "/" + view.second == wanted) return view;
  for (const auto& view : views)
    if (view.second == wanted) return view;
  throw Error(fmt::format("has no view '{}'; there are: {}", printable(wanted, 60), listed(views)));
}

// What turns linear Rec. 709 into the colour space that comes back.
std::pair<OCIO::GroupTransformRcPtr, std::string> entrance(const OCIO::ConstConfigRcPtr& config) {
  const auto steps = OCIO::GroupTransform::Create();
  for (const char* name :
       {"lin_rec709_srgb", "Linear Rec.709 (sRGB)", "lin_rec709", "Linear Rec.709", "Linear BT.709",
        "lin_srgb", "Linear sRGB", "Utility - Linear - Rec.709", "Utility - Linear - sRGB"})
    if (config->getColorSpace(name)) return {steps, name};
  if (config->hasRole(OCIO::ROLE_INTERCHANGE_SCENE)) {
    // To CIE XYZ, by the primaries of IEC 61966-2-1.
    constexpr double kToXyz[] = {0.4123907993,
                                 0.3575843394,
                                 0.1804807884,
                                 0,
                                 0.2126390059,
                                 0.7151686788,
                                 0.0721923154,
                                 0,
                                 0.0193308187,
                                 0.1191947798,
                                 0.9505321522,
                                 0,
                                 0,
                                 0,
                                 0,
                                 1};
    const auto matrix = OCIO::MatrixTransform::Create();
    matrix->setMatrix(kToXyz);
    steps->appendTransform(matrix);
    const auto aces = OCIO::BuiltinTransform::Create();
    aces->setStyle("UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD");
    aces->setDirection(OCIO::TRANSFORM_DIR_INVERSE);
    steps->appendTransform(aces);
    return {steps, OCIO::ROLE_INTERCHANGE_SCENE};
  }
  require(config->hasRole(OCIO::ROLE_SCENE_LINEAR), "says nowhere what linear light is (scene_linear)");
  return {steps, OCIO::ROLE_SCENE_LINEAR};
}

struct NamedProcessor {
  std::string name;
  OCIO::ConstCPUProcessorRcPtr processor;
};

NamedProcessor readProcessor(const std::string& path, const std::string& view) {
  requireWholeName(path);
  const Silence silence;
  try {
    // What is no file, or no text that a person could have written, is not for a parser.
    constexpr std::uintmax_t kMostBytes = 64 << 20;
    std::error_code error;
    require(std::filesystem::is_regular_file(path, error), "is no file that can be read");
    require(std::filesystem::file_size(path, error) <= kMostBytes,
            "is too large for an OpenColorIO configuration");
    std::ifstream file(path, std::ios::binary);
    detail::checkConfigText({std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()});
    const OCIO::ConstConfigRcPtr config = OCIO::Config::CreateFromFile(path.c_str());
    detail::checkVariables(config);
    const auto [display, name] = chosen(config, view);
    const auto [steps, space] = entrance(config);
    const auto shown = OCIO::DisplayViewTransform::Create();
    shown->setSrc(space.c_str());
    shown->setDisplay(display.c_str());
    shown->setView(name.c_str());
    steps->appendTransform(shown);
    detail::checkTransform(config, steps);
    return {display + "/" + name,
            config->getProcessor(steps, OCIO::TRANSFORM_DIR_FORWARD)->getDefaultCPUProcessor()};
  } catch (const OCIO::Exception& error) {
    throw Error(fmt::format("{}: cannot be used as an OpenColorIO configuration: {}", path,
                            reasonOf(path, error.what())));
  } catch (const Error& error) {
    throw Error(fmt::format("{}: {}", path, error.what()));
  }
}

}  // namespace

std::shared_ptr<const ConfigView> readConfigView(const std::string& path, const std::string& view) {
  const auto [name, processor] = readProcessor(path, view);
  const auto apply = [processor = processor](std::span<float> rgb) {
    OCIO::PackedImageDesc pixels(rgb.data(), long(rgb.size() / 3), 1, 3);
    processor->apply(pixels);
  };
  return std::make_shared<ConfigView>(ConfigView{name, apply});
}

std::string configViewIdentity(const std::string& path, const std::string& view) {
  return readProcessor(path, view).processor->getCacheID();
}

}  // namespace nephele
