# Precompiled headers: most of the time to compile a file of this project is spent on
# reading the headers below, so each group of targets reads them once.
#
#   math        standard library and Eigen: every module
#   world       the same, JSON and the headers of the world: the program
#   test        standard library, Eigen and GoogleTest: test programs
#   test_world  the same and the headers of the world: test programs that make worlds
#
# SPLITCUBES_PRECOMPILE=OFF builds without, which shows includes that a file lacks.

set(_math_headers
  <algorithm> <array> <bit> <cassert> <cmath> <cstddef> <cstdint> <cstdio> <cstring> <filesystem> <fstream>
  <functional> <iostream> <limits> <map> <memory> <numbers> <numeric> <optional> <set> <span> <sstream> <string>
  <string_view> <tuple> <utility> <vector> <Eigen/Core> <Eigen/Geometry> <Eigen/LU>)
set(_world_headers ${_math_headers} <nlohmann/json.hpp> <splitcubes/body/body.h>
  <splitcubes/world/world.h>)
set(_test_headers ${_math_headers} <gtest/gtest.h> <gmock/gmock.h>)
set(_test_world_headers ${_test_headers} <splitcubes/body/body.h>
  <splitcubes/world/world.h>)
set(_world_targets splitcubes_world nlohmann_json::nlohmann_json)
set(_test_targets splitcubes_test_flags GTest::gtest GTest::gmock)
set(_test_world_targets ${_test_targets} splitcubes_world)

# splitcubes_precompile(TARGET GROUP): lets the target use the precompiled headers of a group.
function(splitcubes_precompile target group)
  if(NOT SPLITCUBES_PRECOMPILE)
    return()
  endif()
  if(NOT TARGET splitcubes_pch_${group})
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/pch/${group}.cpp CONTENT "")
    add_library(splitcubes_pch_${group} OBJECT EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/pch/${group}.cpp)
    target_link_libraries(splitcubes_pch_${group} PRIVATE splitcubes_flags Eigen3::Eigen ${_${group}_targets})
    target_include_directories(splitcubes_pch_${group} PRIVATE ${PROJECT_SOURCE_DIR}/src)
    target_precompile_headers(splitcubes_pch_${group} PRIVATE ${_${group}_headers})
  endif()
  target_precompile_headers(${target} REUSE_FROM splitcubes_pch_${group})
endfunction()
