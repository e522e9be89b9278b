# Debian packages by CPack, see `make package`: nephele (the program), libnephele-dev (libraries, headers), python3-nephele,
# and libnephele0.1 where the libraries are shared.
set(NEPHELE_MAINTAINER "Nephele authors <authors@nephele.invalid>" CACHE STRING "Whom Debian packages name.")
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT ${NEPHELE_MAINTAINER})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
  WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ${BUILD_SHARED_LIBS})
# Of the libraries of this package.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/modeling ${PROJECT_BINARY_DIR}/levelset
  ${PROJECT_BINARY_DIR}/render)

# nephele_package(<component> <name> SECTION <section> DEPENDS <packages> TEXT <description>)
set(CPACK_COMPONENTS_ALL "")
function(nephele_package component name)
  cmake_parse_arguments(arg "" "SECTION;DEPENDS;TEXT" "" ${ARGN})
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} PARENT_SCOPE)
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${arg_SECTION} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS "${arg_DEPENDS}" PARENT_SCOPE)
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${arg_TEXT}" PARENT_SCOPE)
  install(FILES ${PROJECT_SOURCE_DIR}/cmake/debian_copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name}
    RENAME copyright COMPONENT ${component})
  install(FILES ${PROJECT_BINARY_DIR}/changelog.gz ${PROJECT_BINARY_DIR}/changelog.Debian.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${component})
endfunction()

file(COPY_FILE ${PROJECT_SOURCE_DIR}/CHANGELOG.md ${PROJECT_BINARY_DIR}/changelog ONLY_IF_DIFFERENT)
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
file(WRITE ${PROJECT_BINARY_DIR}/changelog.Debian "nephele (${PROJECT_VERSION}-1) bookworm; urgency=medium

  * Built from its sources; changelog.gz says what has changed.

 -- ${NEPHELE_MAINTAINER}  ${date}
")
execute_process(COMMAND gzip -9nkf ${PROJECT_BINARY_DIR}/changelog ${PROJECT_BINARY_DIR}/changelog.Debian)

set(development libblosc-dev libboost-iostreams-dev libceres-dev libfmt-dev libhwy-dev libimath-dev libkissfft-dev
  libnanovdb-dev libopenexr-dev libopenmesh-dev libopenvdb-dev libpng-dev libsuitesparse-dev libtbb-dev nlohmann-json3-dev
  zlib1g-dev)
foreach(with IN ITEMS CGAL:libcgal-dev EMBREE:libembree-dev FFTW:libfftw3-dev OCIO:libopencolorio-dev)
  string(REPLACE ":" ";" with ${with})
  list(GET with 0 option)
  if(NEPHELE_WITH_${option})
    list(APPEND development ${with})
    list(REMOVE_ITEM development ${option})
  endif()
endforeach()
set(libraries "")
if(BUILD_SHARED_LIBS)
  set(shared libnephele${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  set(libraries "${shared} (= ${PROJECT_VERSION}-1)")
  list(PREPEND development ${libraries})
  file(WRITE ${PROJECT_BINARY_DIR}/triggers "activate-noawait ldconfig\n")
  set(CPACK_DEBIAN_LIBRARIES_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/triggers)
  nephele_package(libraries ${shared} SECTION libs TEXT "Clouds and level sets, shared libraries\n Fields, level sets, clouds and their light.")
endif()
list(JOIN development ", " development)
nephele_package(dev libnephele-dev SECTION libdevel DEPENDS "${development}"
  TEXT "Clouds and level sets, development files\n Libraries, headers, and what CMake and pkg-config need to find them.")
if(NEPHELE_BUILD_APPS)
  nephele_package(program nephele SECTION graphics DEPENDS "${libraries}" TEXT
    "Turns meshes into clouds and level sets\n Level sets, layers of pyroclastic displacement, precomputed light and\n pictures. Cuts models into pieces and carries textures from one to another.")
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS ffmpeg)
endif()
if(TARGET nephele_python)
  math(EXPR next "${Python_VERSION_MINOR} + 1")
  set(python "python3 (>= 3.${Python_VERSION_MINOR})" "python3 (<< 3.${next})" python3-numpy ${libraries})
  list(JOIN python ", " python)
  nephele_package(python python3-nephele SECTION python
    DEPENDS "${python}"
    TEXT "Clouds and level sets, module for Python\n Fields, meshes, grids and pictures with numpy's arrays, and what the\n program does.")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-tqdm")
endif()
include(CPack)
