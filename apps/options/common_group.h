#pragma once

namespace nephele::apps {

/// The group of the options that all verbs have.
inline constexpr const char* kCommonGroup = "Common to all verbs";

}  // namespace nephele::apps
