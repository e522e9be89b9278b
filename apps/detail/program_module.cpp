#include "apps/detail/program_module.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <filesystem>
#include <system_error>

#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

std::string pathOfModule(const char* module) {
  std::error_code ignored;
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path(),
                              beside = folder / module;
  if (std::filesystem::exists(beside, ignored)) return beside.string();
  return (folder / NEPHELE_MODULES_FROM_PROGRAM / module).lexically_normal().string();
}

// Of the module's libraries first what they need themselves: else each of those symbols is looked for in some
// sixty libraries of the program before. Sanitizers do not allow it.
#ifdef NEPHELE_SANITIZED
constexpr int kBinding = RTLD_NOW | RTLD_LOCAL;
#else
constexpr int kBinding = RTLD_NOW | RTLD_LOCAL | RTLD_DEEPBIND;
#endif

}  // namespace

const void* exportedByModule(const char* module, const char* symbol, const char* knows) {
  void* const loaded = dlopen(pathOfModule(module).c_str(), kBinding);
  const void* const found = loaded ? dlsym(loaded, symbol) : nullptr;
  if (!found)
    throw Error(fmt::format("the part of the program that knows {} cannot be loaded, install it again: {}",
                            knows, dlerror()));
  return found;
}

void refuseModule(const char* module, const char* knows) {
  throw Error(fmt::format("the part of the program that knows {} is another version's, install it again: {}",
                          knows, pathOfModule(module)));
}

}  // namespace nephele::apps
