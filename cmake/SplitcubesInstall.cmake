# Installed package: find_package(splitcubes) gives splitcubes::<module> targets
# and splitcubes::splitcubes, which carries all that need no OpenGL.
include(CMakePackageConfigHelpers)
get_property(_modules GLOBAL PROPERTY SPLITCUBES_MODULES)
add_library(splitcubes INTERFACE)
set_target_properties(splitcubes PROPERTIES EXPORT_NAME splitcubes)
foreach(_name core math geometry splitting meshless occlusion cutting body io scene api)
  if(TARGET splitcubes_${_name})
    target_link_libraries(splitcubes INTERFACE splitcubes_${_name})
  endif()
endforeach()
add_library(splitcubes::splitcubes ALIAS splitcubes)

install(TARGETS ${_modules} splitcubes EXPORT splitcubesTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY src/splitcubes DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
install(EXPORT splitcubesTargets NAMESPACE splitcubes:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/splitcubes)
configure_package_config_file(cmake/splitcubesConfig.cmake.in ${CMAKE_BINARY_DIR}/splitcubesConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/splitcubes)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/splitcubesConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/splitcubesConfig.cmake ${CMAKE_BINARY_DIR}/splitcubesConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/splitcubes)
if(TARGET splitcubes_app)
  install(TARGETS splitcubes_app RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  include(SplitcubesManual)
endif()
