#pragma once

#include <CLI/App.hpp>

#include "apps/look/settings.h"
#include "apps/look/subject.h"

namespace nephele::apps {

/// What the command line of the viewer says beside the viewer's own options: what is looked at, and options
/// of the verb of what is shown and of render.
struct LookLine {
  LookSubject subject;
  LookShow::What what;
  LookSettings settings;

  /// From what `app` has left over. @throws CLI::ParseError, Error naming the file.
  static LookLine of(const CLI::App& app);
};

}  // namespace nephele::apps
