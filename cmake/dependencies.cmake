# Every library that nephele uses, found in one place, for its own build and for those who use it installed. Debian 12's
# package names are in cmake/packages.txt. NEPHELE_PARTS says which parts are wanted: modeling, levelset, render.
find_package(Threads REQUIRED)
find_package(TBB REQUIRED)
find_package(hwy REQUIRED)
find_path(KISSFFT_INCLUDE_DIR kissfft/kiss_fftr.h REQUIRED)
find_library(KISSFFT_LIBRARY kissfft-float REQUIRED)

if("levelset" IN_LIST NEPHELE_PARTS OR "render" IN_LIST NEPHELE_PARTS)
  find_package(Ceres REQUIRED)
  find_path(CHOLMOD_INCLUDE_DIR cholmod.h PATH_SUFFIXES suitesparse REQUIRED)
  find_library(CHOLMOD_LIBRARY cholmod REQUIRED)
  find_package(fmt REQUIRED)
  # CGAL brings a find module for it that looks elsewhere.
  find_package(OpenMesh CONFIG REQUIRED)
  find_package(ZLIB REQUIRED)
  find_library(BLOSC_LIBRARY blosc REQUIRED)
  find_package(nlohmann_json REQUIRED)
  if(NEPHELE_WITH_CGAL)
    find_package(CGAL REQUIRED)
  endif()
  if(NEPHELE_WITH_EMBREE)
    find_package(embree 3 REQUIRED)
  endif()

  if(NEPHELE_WITH_FFTW)
    # Debian's has no CMake configuration of single precision.
    find_path(FFTW_INCLUDE_DIR fftw3.h REQUIRED)
    find_library(FFTW_LIBRARY fftw3f REQUIRED)
  endif()

  # Debian's OpenVDB installs its find module, but not on CMake's path.
  list(APPEND CMAKE_MODULE_PATH /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB)
  # It sets this variable unless CGAL was found before.
  set(nephele_shared_libraries ${BUILD_SHARED_LIBS})
  find_package(OpenVDB 10 REQUIRED)
  set(BUILD_SHARED_LIBS ${nephele_shared_libraries})
  list(REMOVE_ITEM CMAKE_MODULE_PATH /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB)
  find_path(NANOVDB_INCLUDE_DIR nanovdb/NanoVDB.h REQUIRED)
endif()

if("render" IN_LIST NEPHELE_PARTS)
  find_package(Imath REQUIRED)
  find_package(OpenEXR REQUIRED)
  find_package(PNG REQUIRED)
  if(NEPHELE_WITH_OCIO)
    # Debian's has no CMake configuration.
    find_path(OPENCOLORIO_INCLUDE_DIR OpenColorIO/OpenColorIO.h REQUIRED)
    find_library(OPENCOLORIO_LIBRARY OpenColorIO REQUIRED)
  endif()
endif()

if(NEPHELE_BUILD_APPS)
  find_package(CLI11 REQUIRED)
  find_package(tomlplusplus REQUIRED)
endif()
if(NEPHELE_BUILD_APPS AND NEPHELE_WITH_READLINE)
  find_path(READLINE_INCLUDE_DIR readline/readline.h REQUIRED)
  find_library(READLINE_LIBRARY readline REQUIRED)
endif()
