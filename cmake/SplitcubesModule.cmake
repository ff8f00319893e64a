# One target per module. The sources are every .cpp below the module's folder,
# the links are what tools/layers.txt allows, so a module cannot reach further.

add_library(splitcubes_flags INTERFACE)
target_compile_features(splitcubes_flags INTERFACE cxx_std_20)
# No contraction: fused multiply-add would change results between machines.
set(_shadow -Wshadow)
if(SPLITCUBES_UNITY)
  # Names and types of other files in the same unit are no concern of a file.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    set(_shadow -Wshadow=local -Wno-subobject-linkage)
  else()
    set(_shadow "")
  endif()
endif()
target_compile_options(splitcubes_flags INTERFACE
  -Wall -Wextra -Wpedantic ${_shadow} -Wnon-virtual-dtor -ffp-contract=off)
if(SPLITCUBES_WARNINGS_AS_ERRORS)
  target_compile_options(splitcubes_flags INTERFACE -Werror)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # False positives of gcc 12 inside inlined Eigen and std::string code (GCC bugs
  # 105562, 105651 and kin).
  target_compile_options(splitcubes_flags INTERFACE -Wno-maybe-uninitialized -Wno-array-bounds
    -Wno-stringop-overflow -Wno-stringop-overread -Wno-restrict)
endif()
# The lowest instruction set is then the scalar one, as gcc 12 has it anyway: clang spends
# minutes on a file with the emulated one.
target_compile_definitions(splitcubes_flags INTERFACE HWY_BROKEN_EMU128=1)
if(SPLITCUBES_PRECOMPILE)
  # So that a compiler cache can tell whether a precompiled header is the same.
  target_compile_options(splitcubes_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>
    "$<$<CXX_COMPILER_ID:Clang>:SHELL:-Xclang -fno-pch-timestamp>")
endif()
if(SPLITCUBES_SANITIZE)
  string(REPLACE ";" "," _sanitize "${SPLITCUBES_SANITIZE}")
  target_compile_options(splitcubes_flags INTERFACE -fsanitize=${_sanitize}
    -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(splitcubes_flags INTERFACE -fsanitize=${_sanitize})
endif()
# Undefined behaviour is looked for in the library and the program only: in the code of the
# tests, the checks cost a third of the time to compile it. Linked after splitcubes_flags.
add_library(splitcubes_test_flags INTERFACE)
if("undefined" IN_LIST SPLITCUBES_SANITIZE)
  target_compile_options(splitcubes_test_flags INTERFACE -fno-sanitize=undefined)
endif()

# Reads tools/layers.txt into SPLITCUBES_DEPS_<module>. Targets have `_` where modules have `/`.
file(STRINGS ${PROJECT_SOURCE_DIR}/tools/layers.txt _layer_lines REGEX "^[a-z]")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tools/layers.txt)
foreach(_line IN LISTS _layer_lines)
  string(REPLACE "/" "_" _line "${_line}")
  string(REGEX MATCH "^([a-z_]+):(.*)$" _ "${_line}")
  set(_name ${CMAKE_MATCH_1})
  string(STRIP "${CMAKE_MATCH_2}" _deps)
  string(REPLACE " " ";" SPLITCUBES_DEPS_${_name} "${_deps}")
endforeach()

# splitcubes_unity(TARGET BATCH SOURCES...): compiles up to BATCH files as one where
# SPLITCUBES_UNITY asks for it. Files that Highway compiles once per instruction set
# include themselves and cannot share a translation unit.
function(splitcubes_unity target batch)
  if(NOT SPLITCUBES_UNITY)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${batch})
  foreach(source IN LISTS ARGN)
    file(STRINGS ${source} per_target REGEX "HWY_TARGET_INCLUDE" LIMIT_COUNT 1)
    if(per_target)
      set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
  endforeach()
endfunction()

# splitcubes_module(FOLDER [external targets...])
function(splitcubes_module folder)
  string(REPLACE "/" "_" name ${folder})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.cpp)
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.h)
  if(sources)
    add_library(splitcubes_${name} STATIC ${sources} ${headers})
    set(scope PUBLIC)
    target_link_libraries(splitcubes_${name} PRIVATE $<BUILD_INTERFACE:splitcubes_flags>)
    splitcubes_precompile(splitcubes_${name} math)
    splitcubes_unity(splitcubes_${name} 12 ${sources})
  else()
    add_library(splitcubes_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(splitcubes::${name} ALIAS splitcubes_${name})
  target_compile_features(splitcubes_${name} ${scope} cxx_std_20)
  target_include_directories(splitcubes_${name} ${scope}
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  foreach(dep IN LISTS SPLITCUBES_DEPS_${name})
    target_link_libraries(splitcubes_${name} ${scope} splitcubes_${dep})
  endforeach()
  target_link_libraries(splitcubes_${name} ${scope} ${ARGN})
  set_target_properties(splitcubes_${name} PROPERTIES EXPORT_NAME ${name})
  set_property(GLOBAL APPEND PROPERTY SPLITCUBES_MODULES splitcubes_${name})
endfunction()

# splitcubes_tests(NAME [targets...]): every .cpp in the current folder becomes one
# GoogleTest program, test_NAME, whose tests carry the label NAME. Those of a long
# program are run in as many parts as SPLITCUBES_TEST_PARTS_NAME says, so that no core
# waits for the last program.
set(SPLITCUBES_TEST_PARTS_splitting 3)
set(SPLITCUBES_TEST_PARTS_dynamics 3)
set(SPLITCUBES_TEST_PARTS_node_motion 2)
set(SPLITCUBES_TEST_PARTS_contact_detection 2)
set(SPLITCUBES_TEST_PARTS_fracture 2)
set(SPLITCUBES_TEST_PARTS_world 6)
set(SPLITCUBES_TEST_PARTS_laws 4)
set(SPLITCUBES_TEST_PARTS_app 4)
set(SPLITCUBES_TEST_PARTS_view 3)

function(splitcubes_tests name)
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  if(NOT sources)
    return()
  endif()
  add_executable(test_${name} ${sources})
  target_link_libraries(test_${name} PRIVATE splitcubes_flags splitcubes_test_flags ${ARGN} GTest::gtest GTest::gmock GTest::gtest_main)
  target_include_directories(test_${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  if(SPLITCUBES_PRECOMPILE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # GoogleTest guards its macros, but not where gcc takes them from a precompiled header.
    target_compile_options(test_${name} PRIVATE -Wno-dangling-else)
  endif()
  if(("splitcubes_world" IN_LIST ARGN AND NOT name MATCHES "allocation") OR name MATCHES "^(scene|laws)$")
    splitcubes_precompile(test_${name} test_world)
  else()
    splitcubes_precompile(test_${name} test)
  endif()
  splitcubes_unity(test_${name} 7 ${sources})
  set(left_out "")
  if(SPLITCUBES_SANITIZE)
    file(STRINGS ${PROJECT_SOURCE_DIR}/tests/slow-under-sanitizers.txt lines REGEX "^(thread:)?${name} ")
    foreach(line IN LISTS lines)
      if(line MATCHES "^thread:" AND SPLITCUBES_SANITIZE MATCHES "thread")
        continue()
      endif()
      string(REGEX MATCH "^[^ ]+ (.*)$" _ "${line}")
      string(REPLACE " " ":" patterns "${CMAKE_MATCH_1}")
      set(left_out "${left_out}:${patterns}")
    endforeach()
    if(left_out)
      string(SUBSTRING "${left_out}" 1 -1 left_out)
      set(left_out "--gtest_filter=-${left_out}")
    endif()
  endif()
  set(parts 1)
  if(SPLITCUBES_TEST_PARTS_${name})
    set(parts ${SPLITCUBES_TEST_PARTS_${name}})
  endif()
  foreach(part RANGE 1 ${parts})
    set(test ${name})
    if(parts GREATER 1)
      set(test ${name}_${part})
    endif()
    math(EXPR index "${part} - 1")
    add_test(NAME ${test} COMMAND test_${name} --gtest_brief=1 ${left_out})
    # The cost starts long programs first.
    set_tests_properties(${test} PROPERTIES TIMEOUT 1500 LABELS ${name} COST ${parts}
      ENVIRONMENT "GTEST_TOTAL_SHARDS=${parts};GTEST_SHARD_INDEX=${index}")
  endforeach()
endfunction()
