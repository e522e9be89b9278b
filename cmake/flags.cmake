# The flags of all our targets. No value-changing optimisation: results must not depend on how loops were vectorised.
add_library(nephele_flags INTERFACE)
target_compile_options(nephele_flags INTERFACE
  -fno-math-errno -fno-trapping-math -ffp-contract=off
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
  $<$<BOOL:${NEPHELE_WARNINGS_AS_ERRORS}>:-Werror>)
# Kernels are compiled for SSE4, AVX2, AVX-512 and without any of them; what SSSE3 would add to the last is not worth the time.
target_compile_definitions(nephele_flags INTERFACE HWY_DISABLED_TARGETS=HWY_SSSE3)

if(NEPHELE_SANITIZE STREQUAL "address")
  add_compile_options(-fsanitize=address,undefined -fno-omit-frame-pointer -fno-sanitize-recover=undefined)
  add_link_options(-fsanitize=address,undefined)
elseif(NEPHELE_SANITIZE STREQUAL "thread")
  add_compile_options(-fsanitize=thread)
  add_link_options(-fsanitize=thread)
elseif(NEPHELE_SANITIZE STREQUAL "fuzzer")
  add_compile_options(-fsanitize=address,undefined,fuzzer-no-link -fno-omit-frame-pointer -fno-sanitize-recover=undefined
    -fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/cmake/sanitizer_ignorelist.txt)
  add_compile_definitions(HWY_COMPILE_ONLY_STATIC)
  add_link_options(-fsanitize=address,undefined)
elseif(NEPHELE_SANITIZE)
  message(FATAL_ERROR "NEPHELE_SANITIZE must be empty, address, thread or fuzzer, got '${NEPHELE_SANITIZE}'")
endif()

# For sources whose JSON is slow to optimise, and that nobody waits for.
set(NEPHELE_QUICK_OPTIONS $<$<CONFIG:Release>:-O1>)

# The standard headers that nearly every source of ours includes, compiled once for each target.
set(NEPHELE_COMMON_HEADERS <algorithm> <array> <cmath> <cstdint> <functional> <limits> <map> <memory> <optional> <span>
  <string> <utility> <vector>)
