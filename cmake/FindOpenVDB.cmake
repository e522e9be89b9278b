# OpenVDB as the target OpenVDB::openvdb. Its own find module comes with it, but not on CMake's path; this one looks for
# what nephele needs, also in OpenVDB_ROOT.
find_path(OpenVDB_INCLUDE_DIR openvdb/openvdb.h)
find_library(OpenVDB_LIBRARY openvdb)
mark_as_advanced(OpenVDB_INCLUDE_DIR OpenVDB_LIBRARY)
if(OpenVDB_INCLUDE_DIR)
  file(STRINGS ${OpenVDB_INCLUDE_DIR}/openvdb/version.h numbers REGEX "#define OPENVDB_LIBRARY_(MAJOR|MINOR|PATCH)_VERSION_NUMBER ")
  string(REGEX MATCHALL "[0-9]+" numbers "${numbers}")
  list(JOIN numbers "." OpenVDB_VERSION)
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenVDB REQUIRED_VARS OpenVDB_LIBRARY OpenVDB_INCLUDE_DIR VERSION_VAR OpenVDB_VERSION
  HANDLE_VERSION_RANGE)
if(OpenVDB_FOUND AND NOT TARGET OpenVDB::openvdb)
  find_package(TBB REQUIRED)
  find_package(Boost REQUIRED COMPONENTS iostreams)
  find_package(Threads REQUIRED)
  # Its headers convert half floats.
  find_package(Imath REQUIRED)
  add_library(OpenVDB::openvdb UNKNOWN IMPORTED)
  set_target_properties(OpenVDB::openvdb PROPERTIES IMPORTED_LOCATION ${OpenVDB_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${OpenVDB_INCLUDE_DIR}
    INTERFACE_LINK_LIBRARIES "Boost::iostreams;TBB::tbb;Threads::Threads;$<LINK_ONLY:Imath::Imath>")
endif()
