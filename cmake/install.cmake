# `find_package(nephele COMPONENTS modeling levelset render)` for other projects: targets nephele::modeling, nephele::levelset
# and nephele::render, headers as <nephele/...>.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/nephele)

foreach(part IN ITEMS headers modeling levelset render)
  set_target_properties(nephele_${part} PROPERTIES EXPORT_NAME ${part})
  install(TARGETS nephele_${part} EXPORT nephele-targets)
endforeach()
foreach(part IN ITEMS modeling levelset render)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${part} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/nephele
    FILES_MATCHING PATTERN "*.h" PATTERN detail EXCLUDE PATTERN "openvdb_*.h" EXCLUDE)
endforeach()
if(NEPHELE_BUILD_APPS)
  install(TARGETS nephele)
endif()

install(EXPORT nephele-targets NAMESPACE nephele:: DESTINATION ${package_folder})
configure_package_config_file(cmake/nephele-config.cmake.in ${PROJECT_BINARY_DIR}/nephele-config.cmake
  INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/nephele-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/nephele-config.cmake ${PROJECT_BINARY_DIR}/nephele-config-version.cmake
  ${PROJECT_SOURCE_DIR}/cmake/dependencies.cmake DESTINATION ${package_folder})
