# Compiles again only what has changed where ccache is installed, in any checkout: paths are taken from the checkout, not from the
# root. It must be told that precompiled headers are safe to cache.
find_program(NEPHELE_CCACHE ccache)
mark_as_advanced(NEPHELE_CCACHE)
if(NEPHELE_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER
    ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
    CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=true ${NEPHELE_CCACHE})
endif()
