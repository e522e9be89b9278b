# `find_package(nephele COMPONENTS modeling levelset render)` for other projects: targets nephele::modeling, nephele::levelset
# and nephele::render, headers as <nephele/...>; the same by pkg-config. The program, the libraries and the module for
# Python are components of the installation: program, dev, python.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/nephele)

foreach(part IN ITEMS headers ${NEPHELE_PARTS})
  set_target_properties(nephele_${part} PROPERTIES EXPORT_NAME ${part})
  install(TARGETS nephele_${part} EXPORT nephele-targets
    ARCHIVE COMPONENT dev LIBRARY COMPONENT libraries NAMELINK_COMPONENT dev)
endforeach()
foreach(part IN LISTS NEPHELE_PARTS)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${part} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/nephele COMPONENT dev
    FILES_MATCHING PATTERN "*.h" PATTERN detail EXCLUDE PATTERN "openvdb_*.h" EXCLUDE)
endforeach()
install(FILES ${PROJECT_SOURCE_DIR}/cmake/nephele.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/nephele COMPONENT dev)

install(EXPORT nephele-targets NAMESPACE nephele:: DESTINATION ${package_folder} COMPONENT dev)
configure_package_config_file(cmake/nephele-config.cmake.in ${PROJECT_BINARY_DIR}/nephele-config.cmake
  INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/nephele-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/nephele-config.cmake ${PROJECT_BINARY_DIR}/nephele-config-version.cmake
  ${PROJECT_SOURCE_DIR}/cmake/dependencies.cmake ${PROJECT_SOURCE_DIR}/cmake/FindOpenVDB.cmake
  DESTINATION ${package_folder} COMPONENT dev)
include(pkg_config)

if(NEPHELE_BUILD_APPS)
  install(TARGETS nephele RUNTIME COMPONENT program)
  if(TARGET nephele_openvdb)
    install(TARGETS nephele_openvdb nephele_look LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/nephele COMPONENT program)
  endif()
  if(TARGET nephele_manual)
    set(manual ${PROJECT_BINARY_DIR}/apps/manual)
    install(DIRECTORY ${manual}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program
      FILES_MATCHING PATTERN "*.1.gz")
    install(FILES ${manual}/nephele.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME nephele
      COMPONENT program)
    install(FILES ${manual}/nephele.zsh DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions RENAME _nephele
      COMPONENT program)
    install(FILES ${manual}/nephele.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d
      COMPONENT program)
  endif()
endif()
if(TARGET nephele_python)
  # Where Debian's Python looks in /usr/local.
  set(NEPHELE_PYTHON_DIR lib/python${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}/dist-packages CACHE STRING
    "Where the module for Python goes.")
  install(TARGETS nephele_python LIBRARY DESTINATION ${NEPHELE_PYTHON_DIR}/nephele COMPONENT python)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/apps/python/nephele DESTINATION ${NEPHELE_PYTHON_DIR} COMPONENT python
    FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN py.typed)
endif()
