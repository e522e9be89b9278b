#pragma once

namespace nephele::apps {

/// What a module of the program exports under a name. Modules lie beside the program where it was built, and
/// in lib/nephele where it is installed; they stay loaded. @throws Error if there is no such module, or none
/// that exports it; `knows` says what it is for: "VDB".
const void* exportedByModule(const char* module, const char* symbol, const char* knows);

/// Throws the Error of a module that was built from other sources.
[[noreturn]] void refuseModule(const char* module, const char* knows);

}  // namespace nephele::apps
