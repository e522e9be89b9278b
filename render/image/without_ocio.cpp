// Views of configurations in builds without OpenColorIO: refused in words.
#include "nephele/modeling/base/error.h"
#include "nephele/render/image/config_view.h"

namespace nephele {
namespace {

[[noreturn]] void refuse(const std::string& path) {
  throw Error(path + ": views of configurations need OpenColorIO, and this nephele was built without it");
}

}  // namespace

std::shared_ptr<const ConfigView> readConfigView(const std::string& path, const std::string&) {
  refuse(path);
}

std::string configViewIdentity(const std::string& path, const std::string&) {
  refuse(path);
}

}  // namespace nephele
