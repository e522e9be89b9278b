#include "nephele/render/image/detail/config_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"

namespace nephele::detail {
namespace {

namespace OCIO = OCIO_NAMESPACE;

constexpr double kMostSteps = 10000;
constexpr int kMostDepth = 100;

/// How much a definition stands for when what it refers to is put in its place.
struct Size {
  double steps = 0;
  int depth = 0;

  Size& operator+=(const Size& other) {
    steps += other.steps;
    depth = std::max(depth, other.depth);
    return *this;
  }
};

/// Sizes of definitions by their names, each found once.
class Definitions {
 public:
  template <class Work>
  Size size(const std::string& name, const Work& work) {
    const auto [entry, isNew] = sizes_.try_emplace(name, Size{-1, 0});
    Size& size = entry->second;
    if (isNew) {
      // Before this itself, or OpenColorIO, has no stack left.
      require(++open_ <= kMostDepth, tooMuch());
      const Size inside = work();
      --open_;
      size = {inside.steps + 1, inside.depth + 1};
      require(size.steps <= kMostSteps && size.depth <= kMostDepth, tooMuch());
    }
    require(size.steps >= 0, fmt::format("{} is defined by itself", printable(name, 60)));
    return size;
  }

 private:
  static std::string tooMuch() {
    return fmt::format("leads through more than {} steps, or through {} within each other", kMostSteps,
                       kMostDepth);
  }

  std::map<std::string, Size> sizes_;
  int open_ = 0;
};

void checkTable(const std::string& path) {
  constexpr std::uintmax_t kMostBytes = 256 << 20;
  std::error_code error;
  const auto check = [&](bool isTrue, std::string_view fault) {
    require(isTrue, fmt::format("the table {} {}", printable(path), fault));
  };
  check(std::filesystem::is_regular_file(path, error), "is no file that can be read");
  check(std::filesystem::file_size(path, error) <= kMostBytes, "has more than 256 MB");
  std::ifstream file(path, std::ios::binary);
  std::string line;
  // Autodesk's tables may name others, which would have to be followed as well.
  while (std::getline(file, line)) check(line.find("<Reference") == line.npos, "refers to other files");
}

class Transforms {
 public:
  explicit Transforms(const OCIO::ConstConfigRcPtr& config)
      : config_(config), context_(config->getCurrentContext()) {}

  Size sizeOf(const OCIO::ConstTransformRcPtr& transform) {
    if (!transform) return {};
    Size size{1, 1};
    switch (transform->getTransformType()) {
      case OCIO::TRANSFORM_TYPE_GROUP: {
        const auto group = OCIO_DYNAMIC_POINTER_CAST<const OCIO::GroupTransform>(transform);
        for (int i = 0; i != group->getNumTransforms(); ++i) size += sizeOf(group->getTransform(i));
        ++size.depth;
        break;
      }
      case OCIO::TRANSFORM_TYPE_FILE: {
        const auto file = OCIO_DYNAMIC_POINTER_CAST<const OCIO::FileTransform>(transform);
        const std::string path = found(file->getSrc());
        if (!path.empty() && tables_.insert(path).second) checkTable(path);
        break;
      }
      case OCIO::TRANSFORM_TYPE_COLORSPACE: {
        const auto change = OCIO_DYNAMIC_POINTER_CAST<const OCIO::ColorSpaceTransform>(transform);
        size += between({change->getSrc(), change->getDst()});
        break;
      }
      case OCIO::TRANSFORM_TYPE_LOOK: {
        const auto look = OCIO_DYNAMIC_POINTER_CAST<const OCIO::LookTransform>(transform);
        size += throughLooks({look->getSrc(), look->getDst()}, look->getLooks());
        break;
      }
      case OCIO::TRANSFORM_TYPE_DISPLAY_VIEW: {
        const auto shown = OCIO_DYNAMIC_POINTER_CAST<const OCIO::DisplayViewTransform>(transform);
        size += throughView(shown->getSrc(), shown->getDisplay(), shown->getView());
        break;
      }
      default:
        break;
    }
    return size;
  }

 private:
  /// Empty where there is none: OpenColorIO says so if it is needed.
  std::string found(const char* table) const {
    try {
      return context_->resolveFileLocation(table);
    } catch (const OCIO::Exception&) {
      return {};
    }
  }

  /// Spaces are named by their own name, an alias or a role; a named transform may stand in their place.
  Size between(const std::vector<std::string>& spaces) {
    Size size;
    std::set<OCIO::ReferenceSpaceType> references;
    for (const std::string& name : spaces) {
      const std::string resolved = context_->resolveStringVar(name.c_str());
      if (const auto space = config_->getColorSpace(resolved.c_str())) {
        references.insert(space->getReferenceSpaceType());
        size += definitions_.size(fmt::format("the colour space '{}'", space->getName()), [&] {
          Size both = sizeOf(space->getTransform(OCIO::COLORSPACE_DIR_TO_REFERENCE));
          return both += sizeOf(space->getTransform(OCIO::COLORSPACE_DIR_FROM_REFERENCE));
        });
      } else if (const auto named = config_->getNamedTransform(resolved.c_str())) {
        size += definitions_.size(fmt::format("the transform '{}'", named->getName()), [&] {
          Size both = sizeOf(named->getTransform(OCIO::TRANSFORM_DIR_FORWARD));
          return both += sizeOf(named->getTransform(OCIO::TRANSFORM_DIR_INVERSE));
        });
      }
    }
    if (references.size() > 1) size += throughViewTransform(config_->getDefaultSceneToDisplayViewTransform());
    return size;
  }

  Size throughViewTransform(const OCIO::ConstViewTransformRcPtr& view) {
    if (!view) return {};
    return definitions_.size(fmt::format("the view transform '{}'", view->getName()), [&] {
      Size both = sizeOf(view->getTransform(OCIO::VIEWTRANSFORM_DIR_TO_REFERENCE));
      return both += sizeOf(view->getTransform(OCIO::VIEWTRANSFORM_DIR_FROM_REFERENCE));
    });
  }

  Size throughLooks(std::vector<std::string> spaces, const std::string& looks) {
    Size size;
    const std::string text = context_->resolveStringVar(looks.c_str());
    constexpr std::string_view kBetween = " \t+-,:|";
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = std::min(text.find_first_of(",:|", begin), text.size());
      const std::size_t first = std::min(text.find_first_not_of(kBetween, begin), end);
      const std::size_t last = text.find_last_not_of(kBetween, end == 0 ? 0 : end - 1);
      const std::string name = first < end && last >= first ? text.substr(first, last - first + 1) : "";
      begin = end + 1;
      const auto look = config_->getLook(name.c_str());
      if (!look) continue;
      spaces.emplace_back(look->getProcessSpace());
      size += definitions_.size(fmt::format("the look '{}'", look->getName()), [&] {
        Size both = sizeOf(look->getTransform());
        return both += sizeOf(look->getInverseTransform());
      });
    }
    return size += between(spaces);
  }

  Size throughView(const std::string& source, const std::string& display, const std::string& view) {
    const auto text = [](const char* words) { return std::string(words ? words : ""); };
    std::string space = text(config_->getDisplayViewColorSpaceName(display.c_str(), view.c_str()));
    if (space == OCIO::OCIO_VIEW_USE_DISPLAY_NAME) space = display;
    Size size = throughViewTransform(
        config_->getViewTransform(config_->getDisplayViewTransformName(display.c_str(), view.c_str())));
    return size +=
           throughLooks({source, space}, text(config_->getDisplayViewLooks(display.c_str(), view.c_str())));
  }

  OCIO::ConstConfigRcPtr config_;
  OCIO::ConstContextRcPtr context_;
  Definitions definitions_;
  std::set<std::string> tables_;
};

/// Whether a mark of YAML (`&name`, `*name`) may stand after `before`.
bool isBetweenWords(char before) {
  return std::string_view(" \t\r\n[{,:-").find(before) != std::string_view::npos;
}

}  // namespace

void checkConfigText(const std::string& text) {
  // So many, however they lie within each other, stand for no more than some hundred times the text.
  constexpr std::size_t kMostRepeats = 16;
  std::set<std::string_view> anchors;
  std::size_t repeats = 0;
  const std::string_view all = text;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if ((all[i] != '&' && all[i] != '*') || (i > 0 && !isBetweenWords(all[i - 1]))) continue;
    const std::string_view name = all.substr(i + 1, all.find_first_of(" \t\r\n[]{},:", i) - i - 1);
    if (name.empty()) continue;
    if (all[i] == '&')
      anchors.insert(name);
    else
      repeats += anchors.contains(name);
  }
  require(repeats <= kMostRepeats,
          fmt::format("repeats parts of itself (*name) more than {} times", kMostRepeats));
}

void checkTransform(const OCIO::ConstConfigRcPtr& config, const OCIO::ConstTransformRcPtr& transform) {
  Transforms(config).sizeOf(transform);
}

void checkVariables(const OCIO::ConstConfigRcPtr& config) {
  std::vector<std::string> names;
  for (int i = 0; i != config->getNumEnvironmentVars(); ++i)
    names.emplace_back(config->getEnvironmentVarNameByIndex(i));
  Definitions definitions;
  const auto sizeOf = [&](const auto& self, const std::string& name) -> Size {
    return definitions.size(fmt::format("the variable '{}'", name), [&] {
      Size size;
      const std::string value = config->getEnvironmentVarDefault(name.c_str());
      // $NAME, ${NAME} or %NAME%, or the beginning of a longer name.
      for (std::size_t i = 0; i < value.size(); ++i) {
        if (value[i] != '$' && value[i] != '%') continue;
        const std::size_t begin = i + 1 + (value.compare(i, 2, "${") == 0);
        for (const std::string& other : names)
          if (value.compare(begin, other.size(), other) == 0) size += self(self, other);
      }
      return size;
    });
  };
  for (const std::string& name : names) sizeOf(sizeOf, name);
}

}  // namespace nephele::detail
