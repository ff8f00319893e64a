# Checks that the source files which a unity build compiles as one have no free function
# of the same name in their anonymous namespaces. Two of one signature do not compile;
# two of different signatures do, and a call may silently take the other file's.
#
#   cmake -P tools/check_unity.cmake                  this source tree
#   cmake -DROOT=<folder> -P tools/check_unity.cmake  another one
#   cmake -DSELF_TEST=<empty folder> -P ...           proves, there, that it can fail
cmake_minimum_required(VERSION 3.22)

# --- the self-test ------------------------------------------------------------

function(expect_check result text)
  execute_process(COMMAND ${CMAKE_COMMAND} -DROOT=${SELF_TEST} -P ${CMAKE_CURRENT_FUNCTION_LIST_FILE}
    RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  set(got good)
  if(NOT code EQUAL 0)
    set(got bad)
  endif()
  string(FIND "${output}" "${text}" at)
  if(NOT got STREQUAL result OR at EQUAL -1)
    message(FATAL_ERROR "self-test: expected ${result} with '${text}', got ${got}:\n${output}")
  endif()
endfunction()

if(SELF_TEST)
  set(source ${SELF_TEST}/src/splitcubes)
  file(REMOVE_RECURSE ${SELF_TEST}/src ${SELF_TEST}/apps)
  set(begin "namespace splitcubes {\nnamespace {\n\n")
  set(end "\n}  // namespace\n\nint outside(int x) { return x; }\n}  // namespace splitcubes\n")
  file(WRITE ${source}/low/a.cpp "${begin}int first(int x) {\n    return twice(x);\n}${end}")
  file(WRITE ${source}/low/b.cpp "${begin}int twice(int x) { return 2 * x; }${end}")
  file(WRITE ${source}/high/a.cpp "${begin}int first(int x) { return x; }${end}")
  expect_check(good "no file takes another's function")
  file(WRITE ${source}/low/inner/c.cpp "${begin}template <class T>\nconst T& first(const T& x,\n          int y) { return x; }${end}")
  expect_check(bad "low/inner/c.cpp: first() is also in src/splitcubes/low/a.cpp")
  file(WRITE ${source}/low/inner/c.cpp "${begin}double outside(double x) { return x; }${end}")
  expect_check(good "no file takes another's function")
  file(WRITE ${SELF_TEST}/apps/program/a.cpp "${begin}std::vector<int> some() { return {}; }${end}")
  file(WRITE ${SELF_TEST}/apps/program/figures/b.cpp "${begin}int *some(int x[]) { return x; }${end}")
  expect_check(bad "figures/b.cpp: some() is also in apps/program/a.cpp")
  message(STATUS "check_unity can fail as it should")
  return()
endif()

# --- the check ----------------------------------------------------------------

if(NOT ROOT)
  get_filename_component(ROOT ${CMAKE_CURRENT_LIST_DIR}/.. ABSOLUTE)
endif()
set(problems "")
set(checked 0)

# The names of the free functions that a file defines in anonymous namespaces: what stands at the
# beginning of a line there, has a type before it and a parenthesis behind it.
function(list_functions path names_out)
  file(READ ${path} text)
  # Lists of CMake are split at semicolons and take brackets as their own.
  string(REPLACE ";" "," text "${text}")
  string(REPLACE "[" "(" text "${text}")
  string(REPLACE "]" ")" text "${text}")
  string(REPLACE "\n" ";" lines "${text}")
  set(names "")
  set(inside FALSE)
  foreach(line IN LISTS lines)
    if(line MATCHES "^namespace {")
      set(inside TRUE)
    elseif(line MATCHES "^}  // namespace$")
      set(inside FALSE)
    elseif(inside AND line MATCHES "^[A-Za-z][A-Za-z0-9_:<>, &*]*[ &*>]([A-Za-z0-9_]+)\\(")
      list(APPEND names ${CMAKE_MATCH_1})
    endif()
  endforeach()
  list(REMOVE_DUPLICATES names)
  set(${names_out} "${names}" PARENT_SCOPE)
endfunction()

file(GLOB groups RELATIVE ${ROOT} ${ROOT}/src/splitcubes/* ${ROOT}/apps/* ${ROOT}/tests/*)
list(REMOVE_ITEM groups tests/fuzz)  # a program per file
foreach(group IN LISTS groups)
  if(group MATCHES "^tests/")
    file(GLOB files RELATIVE ${ROOT} ${ROOT}/${group}/*.cpp)
  else()
    file(GLOB_RECURSE files RELATIVE ${ROOT} ${ROOT}/${group}/*.cpp)
  endif()
  list(SORT files)
  set(known "")
  foreach(file IN LISTS files)
    math(EXPR checked "${checked} + 1")
    list_functions(${ROOT}/${file} names)
    foreach(name IN LISTS names)
      if(name IN_LIST known)
        string(APPEND problems "${file}: ${name}() is also in ${file_of_${name}}\n")
      else()
        list(APPEND known ${name})
        set(file_of_${name} ${file})
      endif()
    endforeach()
  endforeach()
endforeach()

if(problems)
  message(NOTICE "${problems}")
  message(FATAL_ERROR "functions of one name in files that are compiled as one; rename one of each")
endif()
message(STATUS "${checked} files: no file takes another's function")
