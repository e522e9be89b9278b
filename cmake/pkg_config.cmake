# nephele-modeling.pc, nephele-levelset.pc and nephele-render.pc, with what each library is linked with here.

# Everything that `target` is linked with but our own libraries, as a linker takes it.
function(nephele_link_items target result)
  get_target_property(next ${target} INTERFACE_LINK_LIBRARIES)
  set(seen "")
  set(items "")
  while(next)
    list(POP_FRONT next item)
    while(item MATCHES "^\\$<LINK_ONLY:(.*)>$")
      set(item "${CMAKE_MATCH_1}")
    endwhile()
    if(item IN_LIST seen OR item MATCHES "^(\\$|nephele)" OR item STREQUAL "")
      continue()
    endif()
    list(APPEND seen ${item})
    if(NOT TARGET ${item})
      if(IS_ABSOLUTE ${item} OR item MATCHES "^-")
        list(APPEND items ${item})
      elseif(NOT item MATCHES "::")
        list(APPEND items -l${item})
      endif()
      continue()
    endif()
    get_target_property(type ${item} TYPE)
    if(NOT type STREQUAL "INTERFACE_LIBRARY")
      list(APPEND items $<TARGET_LINKER_FILE:${item}>)
    endif()
    get_target_property(more ${item} INTERFACE_LINK_LIBRARIES)
    if(more)
      list(APPEND next ${more})
    endif()
  endwhile()
  set(${result} "${items}" PARENT_SCOPE)
endfunction()

set(requires "")
file(RELATIVE_PATH to_prefix /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
foreach(part IN LISTS NEPHELE_PARTS)
  nephele_link_items(nephele_${part} items)
  list(JOIN items " " items)
  # A static library needs what it was made with at every link.
  get_target_property(type nephele_${part} TYPE)
  set(separator " ")
  if(type STREQUAL "SHARED_LIBRARY")
    set(separator "\nLibs.private: ")
  endif()
  file(GENERATE OUTPUT ${PROJECT_BINARY_DIR}/nephele-${part}.pc CONTENT
"prefix=\${pcfiledir}/${to_prefix}
libdir=\${prefix}/${CMAKE_INSTALL_LIBDIR}
includedir=\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}

Name: nephele-${part}
Description: ${PROJECT_DESCRIPTION}
Version: ${PROJECT_VERSION}
Requires: ${requires}
Cflags: -I\${includedir} -std=c++20
Libs: -L\${libdir} -lnephele_${part}${separator}${items}
")
  install(FILES ${PROJECT_BINARY_DIR}/nephele-${part}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
  set(requires nephele-${part})
endforeach()
