# Checks two limits in src, apps and tests: a class or struct has at most 25 non-static data
# members, and a header includes at most 40 headers of the project, directly or through others.
# Doxygen lists the data members; it does not see types that are local to a function.
#
#   cmake -DWORK=<folder> -P tools/check_sizes.cmake   this source tree; WORK gets Doxygen's files
#   cmake -DWORK=<folder> -DROOT=<folder> -P ...       another one
#   cmake -DSELF_TEST=<empty folder> -P ...            proves, there, that it can fail
#
# DOXYGEN_PROGRAM names Doxygen if it is not in the PATH. Prints a line for each class and
# header above its limit and then fails.
cmake_minimum_required(VERSION 3.22)

set(max_data_members 25)
set(max_included_headers 40)

find_program(DOXYGEN_PROGRAM doxygen)
if(NOT DOXYGEN_PROGRAM)
  message(FATAL_ERROR "check_sizes needs doxygen")
endif()

# --- the self-test ------------------------------------------------------------

# Runs the check on the tree below SELF_TEST; its exit must be good or bad and its
# output must contain a text.
function(expect_check result text)
  execute_process(COMMAND ${CMAKE_COMMAND} -DROOT=${SELF_TEST} -DWORK=${SELF_TEST}/work
      -DDOXYGEN_PROGRAM=${DOXYGEN_PROGRAM} -P ${CMAKE_CURRENT_FUNCTION_LIST_FILE}
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

# Writes a class with data members m1 to m<count>, and with members that do not count.
function(write_class path count)
  set(members "    static int shared;\n    struct Inner {\n        int a, b, c;\n    };\n    int size() const { int local = 0; return local; }\n")
  foreach(number RANGE 3 ${count})
    string(APPEND members "    std::vector<Inner> m${number}{};  // int not_a_member;\n")
  endforeach()
  file(WRITE ${path}
    "#include <vector>\nnamespace a {\nnamespace {\nclass Large {\n  private:\n    int m1 = 0, m2[2];\n${members}};\n}\n}\n")
endfunction()

# Writes headers h0.h to h<length>.h; each of them includes the next one, and the last one the first.
function(write_chain folder length)
  foreach(number RANGE 1 ${length})
    math(EXPR previous "${number} - 1")
    file(WRITE ${folder}/h${previous}.h
      "#pragma once\n#include <vector>\n#include \"h${number}.h\"\n#include <splitcubes/low/h${number}.h>\n")
  endforeach()
  file(WRITE ${folder}/h${length}.h "#pragma once\n// #include \"large.h\"\n#include \"h0.h\"\n")
endfunction()

if(SELF_TEST)
  set(source ${SELF_TEST}/src/splitcubes)
  file(REMOVE_RECURSE ${SELF_TEST}/src ${SELF_TEST}/apps ${SELF_TEST}/tests ${SELF_TEST}/work)
  write_class(${source}/low/large.h 25)
  write_chain(${source}/low 40)
  expect_check(good "2 classes and 42 headers are within the limits")
  write_class(${source}/low/large.h 26)
  expect_check(bad "src/splitcubes/low/large.h:4: class a::anonymous_namespace{large.h}::Large has 26 data members; at most 25 are allowed")
  file(REMOVE ${source}/low/large.h)
  write_class(${SELF_TEST}/apps/program/large.cpp 26)
  expect_check(bad "apps/program/large.cpp:4: class a::anonymous_namespace{large.cpp}::Large has 26 data members")
  file(REMOVE ${SELF_TEST}/apps/program/large.cpp)
  write_class(${source}/low/small.h 3)
  file(WRITE ${SELF_TEST}/tests/low/first.h "#include \"other/second.h\"\n#include <splitcubes/low/h0.h>\n")
  expect_check(bad "tests/low/first.h: includes 41 headers of the project; at most 40 are allowed")
  file(WRITE ${SELF_TEST}/tests/other/second.h "\n")
  expect_check(bad "tests/low/first.h: includes 42 headers of the project")
  file(REMOVE ${SELF_TEST}/tests/low/first.h)
  expect_check(good "are within the limits")
  write_chain(${source}/low 41)
  expect_check(bad "src/splitcubes/low/h0.h: includes 41 headers of the project")
  file(REMOVE_RECURSE ${SELF_TEST}/src)
  expect_check(bad "no class is found")
  message(STATUS "check_sizes can fail as it should")
  return()
endif()

# --- the check ----------------------------------------------------------------

if(NOT ROOT)
  get_filename_component(ROOT ${CMAKE_CURRENT_LIST_DIR}/.. ABSOLUTE)
endif()
if(NOT WORK)
  message(FATAL_ERROR "check_sizes needs -DWORK=<folder>")
endif()
set(problems "")

# Headers: those that each includes itself. A quoted path is relative to the header's folder or to one of
# the folders that a compiler searches.
file(GLOB_RECURSE headers RELATIVE ${ROOT} ${ROOT}/src/*.h ${ROOT}/apps/*.h ${ROOT}/tests/*.h)
list(SORT headers)
foreach(header IN LISTS headers)
  get_filename_component(folder ${header} DIRECTORY)
  set(direct "")
  file(STRINGS ${ROOT}/${header} includes REGEX "^[ \t]*#[ \t]*include[ \t]*[<\"]")
  foreach(include IN LISTS includes)
    if(NOT include MATCHES "[<\"]([^>\"]+)[>\"]")
      continue()
    endif()
    set(name ${CMAKE_MATCH_1})
    foreach(searched ${folder} src tests apps/splitcubes)
      get_filename_component(path ${ROOT}/${searched}/${name} ABSOLUTE)
      file(RELATIVE_PATH path ${ROOT} ${path})
      if(path IN_LIST headers)
        list(APPEND direct ${path})
        break()
      endif()
    endforeach()
  endforeach()
  set("direct_${header}" "${direct}")
endforeach()
foreach(header IN LISTS headers)
  set(included "")
  set(next "${direct_${header}}")
  while(next)
    set(found "")
    foreach(other IN LISTS next)
      if(NOT other STREQUAL header AND NOT other IN_LIST included)
        list(APPEND included ${other})
        list(APPEND found ${direct_${other}})
      endif()
    endforeach()
    set(next "${found}")
  endwhile()
  list(LENGTH included count)
  if(count GREATER max_included_headers)
    string(APPEND problems
      "${header}: includes ${count} headers of the project; at most ${max_included_headers} are allowed\n")
  endif()
endforeach()

# Data members: by Doxygen, one XML file a class.
set(inputs "")
foreach(folder src apps tests)
  if(EXISTS ${ROOT}/${folder})
    string(APPEND inputs " \"${ROOT}/${folder}\"")
  endif()
endforeach()
file(REMOVE_RECURSE ${WORK}/xml)
file(WRITE ${WORK}/Doxyfile "\
INPUT                 =${inputs}
FILE_PATTERNS         = *.h *.cpp
RECURSIVE             = YES
STRIP_FROM_PATH       = \"${ROOT}\"
OUTPUT_DIRECTORY      = \"${WORK}\"
GENERATE_XML          = YES
XML_PROGRAMLISTING    = NO
GENERATE_HTML         = NO
GENERATE_LATEX        = NO
EXTRACT_ALL           = YES
EXTRACT_PRIVATE       = YES
EXTRACT_LOCAL_CLASSES = YES
EXTRACT_ANON_NSPACES  = YES
ENABLE_PREPROCESSING  = NO
MARKDOWN_SUPPORT      = NO
AUTOLINK_SUPPORT      = NO
QUIET                 = YES
WARNINGS              = NO
")
execute_process(COMMAND ${DOXYGEN_PROGRAM} ${WORK}/Doxyfile WORKING_DIRECTORY ${WORK}
  RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "doxygen failed:\n${output}")
endif()
file(GLOB classes ${WORK}/xml/class*.xml ${WORK}/xml/struct*.xml)
list(SORT classes)
foreach(class IN LISTS classes)
  file(STRINGS ${class} members REGEX "<memberdef kind=\"variable\" [^>]*static=\"no\"")
  list(LENGTH members count)
  if(count GREATER max_data_members)
    # The class itself stands at an indentation of four, its members deeper.
    file(READ ${class} text)
    string(REGEX MATCH "<compounddef [^>]*kind=\"([a-z]+)\"[^\n]*\n *<compoundname>([^\n]*)</compoundname>" name "${text}")
    set(name "${CMAKE_MATCH_1} ${CMAKE_MATCH_2}")
    string(REGEX MATCH "\n    <location file=\"([^\"]+)\" line=\"([0-9]+)\"" place "${text}")
    string(APPEND problems
      "${CMAKE_MATCH_1}:${CMAKE_MATCH_2}: ${name} has ${count} data members; at most ${max_data_members} are allowed\n")
  endif()
endforeach()

list(LENGTH classes class_count)
list(LENGTH headers header_count)
if(class_count EQUAL 0)
  string(APPEND problems "no class is found\n")
endif()
if(problems)
  # The notice keeps each problem on a line of its own, which an error would wrap.
  message(NOTICE "${problems}")
  message(FATAL_ERROR "classes or headers are above their limits")
endif()
message(STATUS "${class_count} classes and ${header_count} headers are within the limits")
