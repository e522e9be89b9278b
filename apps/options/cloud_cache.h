#pragma once

#include <string>

#include "apps/app.h"
#include "nephele/levelset/cloud/cloud.h"
#include "nephele/levelset/cloud/level_cache.h"

namespace nephele::apps {

struct CloudArguments;

/// Where the layers of clouds are kept, as typed.
struct CloudCacheArguments {
  LevelCache::Options cache;
  /// What all options were read from.
  const CLI::App* app = nullptr;

  /// The cloud on a shape, from layers that were kept, where there are any and a folder was given. Says in
  /// the statistics of `run` what was of use. @throws Error as makeCloud; Cancelled.
  Cloud grown(const Mesh& shape, const CloudArguments& arguments, const CloudOptions& options,
              Run& run) const;
};

/// Declares the options on `app`.
void addCloudCacheOptions(CLI::App& app, CloudCacheArguments& arguments);

}  // namespace nephele::apps
