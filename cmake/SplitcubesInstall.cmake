# Installed package: the public headers (api/), the archives behind them, and what finds them:
# find_package(splitcubes) gives splitcubes::splitcubes, pkg-config splitcubes the same.
include(CMakePackageConfigHelpers)

# Of a module and all below it, those first that need the others.
function(_splitcubes_below name out)
  set(found "")
  foreach(dep IN LISTS SPLITCUBES_DEPS_${name})
    _splitcubes_below(${dep} below)
    list(REMOVE_ITEM found ${below})
    list(APPEND found ${below})
  endforeach()
  set(${out} ${name} ${found} PARENT_SCOPE)
endfunction()
_splitcubes_below(api _installed)
set(_targets splitcubes)
set(_archives "")
foreach(_name IN LISTS _installed)
  list(APPEND _targets splitcubes_${_name})
  get_target_property(_type splitcubes_${_name} TYPE)
  if(_type STREQUAL "STATIC_LIBRARY")
    string(APPEND _archives " -lsplitcubes_${_name}")
  endif()
endforeach()

install(TARGETS ${_targets} EXPORT splitcubesTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY src/splitcubes/api DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/splitcubes
  FILES_MATCHING PATTERN "*.h" PATTERN internal EXCLUDE)
set(_package ${CMAKE_INSTALL_LIBDIR}/cmake/splitcubes)
install(EXPORT splitcubesTargets NAMESPACE splitcubes:: DESTINATION ${_package})
configure_package_config_file(cmake/splitcubesConfig.cmake.in ${PROJECT_BINARY_DIR}/splitcubesConfig.cmake
  INSTALL_DESTINATION ${_package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/splitcubesConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/splitcubesConfig.cmake ${PROJECT_BINARY_DIR}/splitcubesConfigVersion.cmake
  DESTINATION ${_package})

# The prefix is told by the file's own place, so that it can be moved.
file(RELATIVE_PATH _up /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
set(SPLITCUBES_PC_PREFIX "\${pcfiledir}/${_up}")
set(SPLITCUBES_PC_LIBS "-L\${libdir}${_archives}")
configure_file(cmake/splitcubes.pc.in ${PROJECT_BINARY_DIR}/splitcubes.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/splitcubes.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

if(TARGET splitcubes_app)
  install(TARGETS splitcubes_app RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  # What the viewer offers where no file is named.
  install(DIRECTORY scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/splitcubes)
  include(SplitcubesManual)
endif()
