#pragma once

namespace nephele::apps {

/// The group of the options that all verbs have.
inline constexpr const char* kCommonGroup = "Common to all verbs";
/// The group of those by which one command line stands for several calls.
inline constexpr const char* kSeveralGroup = "Sequences and wedges";

}  // namespace nephele::apps
