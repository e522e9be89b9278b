#include "apps/detail/program_module.h"
#include "apps/look/functions.h"

namespace nephele::apps {

std::unique_ptr<LookServer> makeLookServer(const LookServerOptions& options) {
  constexpr char kModule[] = "nephele-look.so", kKnows[] = "how to serve pages";
  const auto& exported =
      *static_cast<const LookFunctions*>(exportedByModule(kModule, "nepheleLookFunctions", kKnows));
  if (!exported.isOf({})) refuseModule(kModule, kKnows);
  return exported.make(options);
}

}  // namespace nephele::apps
