# What makes up most of the fuzzer's time and sees no bytes of a file.
#
# Noises, kernels and light: without sanitizers, with which clang also takes minutes for each of them. Kernels that read grids and
# meshes keep those of memory.
set(not_followed -fno-sanitize-coverage=edge,trace-cmp,inline-8bit-counters,pc-table,indirect-calls)
set(NEPHELE_UNINSTRUMENTED -fno-sanitize=all ${not_followed})
foreach(part IN ITEMS modeling levelset render)
  file(GLOB_RECURSE kernels ${PROJECT_SOURCE_DIR}/${part}/*_kernels.cpp ${PROJECT_SOURCE_DIR}/${part}/noise/*.cpp
    ${PROJECT_SOURCE_DIR}/${part}/light/*.cpp)
  set(options ${NEPHELE_UNINSTRUMENTED})
  if(part STREQUAL "levelset")
    set(options -fno-sanitize=undefined ${not_followed})
  endif()
  set_source_files_properties(${kernels} TARGET_DIRECTORY nephele_${part} PROPERTIES
    COMPILE_OPTIONS "-O2;${options}" SKIP_PRECOMPILE_HEADERS ON)
endforeach()
# Comparisons are followed where files and options are read: they show which bytes are words of a format.
foreach(part IN ITEMS modeling levelset render)
  get_target_property(sources nephele_${part} SOURCES)
  list(FILTER sources EXCLUDE REGEX "(TARGET_OBJECTS|_kernels\\.cpp|noise/|light/|/io/|^io/|image/|scene/)")
  foreach(source IN LISTS sources)
    set_property(SOURCE ${source} TARGET_DIRECTORY nephele_${part} APPEND PROPERTY COMPILE_OPTIONS
      -fno-sanitize-coverage=trace-cmp)
  endforeach()
endforeach()
