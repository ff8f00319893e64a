# Checks that the source files of src/splitcubes define no floating-point constants at namespace scope:
# tolerances, shares and limits stand in the tuning.h of their module (docs/tuning.md), each with a comment.
# tools/constants.txt lists the exceptions.
#
#   cmake -P tools/check_constants.cmake                  this source tree
#   cmake -DROOT=<folder> -P tools/check_constants.cmake  another one
#   cmake -DSELF_TEST=<empty folder> -P ...               proves, there, that it can fail
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
  set(list ${SELF_TEST}/tools/constants.txt)
  file(REMOVE_RECURSE ${SELF_TEST}/src ${SELF_TEST}/tools)
  file(WRITE ${list} "# comment\nlow/a.cpp: marker  # reason\n")
  file(WRITE ${source}/low/tuning.h "/// Share, 0 to 1.\ninline constexpr double share = 0.5;\n")
  string(CONCAT good "constexpr double marker = -2;\nconstexpr double turn = 2 * std::numbers::pi;\n"
    "constexpr float far = std::numeric_limits<float>::infinity();\nconstexpr double less = -tuning::share;\n"
    "const float* force(const double* x);\nconstexpr double twice(double x) { return 2 * x; }\n"
    "constexpr std::size_t grain = 64;\nvoid f() {\n    constexpr double local = 0.5;\n}\n")
  file(WRITE ${source}/low/a.cpp "${good}")
  expect_check(good "no constant outside of a tuning.h")
  foreach(line "constexpr double slack = 1e-3;" "static const float slack{0.5F};"
      "constexpr double turn = 2 * std::numbers::pi, slack = 0.1;"
      "constexpr std::array<double, 2> slack{\n    0.1,\n    0.2};" "constexpr auto slack = 1e-3;"
      "inline constexpr std::pair<float, int> slack{0.5F, 1};")
    file(WRITE ${source}/low/inner/b.cpp "namespace {\n\n// [ ; ]\n${line}\n\n}  // namespace\n")
    expect_check(bad "low/inner/b.cpp:4: slack ")
  endforeach()
  file(REMOVE_RECURSE ${source}/low/inner)
  file(WRITE ${source}/low/a.cpp "constexpr int marker = 1;\n")
  expect_check(bad "tools/constants.txt: low/a.cpp defines no constant marker")
  file(WRITE ${source}/low/a.cpp "${good}")
  file(APPEND ${source}/low/tuning.h "\ninline constexpr int count = 2;\n")
  expect_check(bad "low/tuning.h:4: count has no comment")
  message(STATUS "check_constants can fail as it should")
  return()
endif()

# --- the check ----------------------------------------------------------------

if(NOT ROOT)
  get_filename_component(ROOT ${CMAKE_CURRENT_LIST_DIR}/.. ABSOLUTE)
endif()
set(problems "")
set(checked 0)

# The lines of a file. Lists of CMake are split at semicolons and take brackets as their own: `@` stands for a
# semicolon, parentheses for brackets; a line is never empty.
function(read_lines path lines_out)
  file(READ ${path} text)
  string(REPLACE ";" "@" text "${text}")
  string(REPLACE "[" "(" text "${text}")
  string(REPLACE "]" ")" text "${text}")
  string(REPLACE "\\" "/" text "${text}")
  string(REPLACE "\n" " ;" text "${text}")
  set(${lines_out} "${text}" PARENT_SCOPE)
endfunction()

set(allowed "")
if(EXISTS ${ROOT}/tools/constants.txt)
  file(STRINGS ${ROOT}/tools/constants.txt entries REGEX "^[^#]")
  foreach(entry IN LISTS entries)
    if(NOT entry MATCHES "^([^ :]+): ([A-Za-z0-9_]+)  # ")
      string(APPEND problems "tools/constants.txt: '${entry}' is not `file: name  # reason`\n")
      continue()
    endif()
    list(APPEND allowed "${CMAKE_MATCH_1}:${CMAKE_MATCH_2}")
  endforeach()
endif()
set(unused ${allowed})

# Notes the names that a statement defines with numbers of its own.
macro(check_statement statement line_number)
  string(REGEX REPLACE "//[^@]*$" "" definition "${statement}")
  string(REGEX REPLACE "@.*$" "" definition "${definition}")
  # A declarator begins with a name and `=` or `{` and ends before the next one.
  string(REGEX REPLACE "([A-Za-z_][A-Za-z0-9_]* ?[={])" ";\\1" declarators "${definition}")
  list(POP_FRONT declarators)
  foreach(declarator IN LISTS declarators)
    string(REGEX MATCH "^[A-Za-z0-9_]+" name "${declarator}")
    list(REMOVE_ITEM unused "${file}:${name}")
    if("${file}:${name}" IN_LIST allowed OR declarator MATCHES "std::numbers::|std::numeric_limits<|tuning::")
      continue()
    endif()
    string(APPEND problems "src/splitcubes/${file}:${line_number}: ${name} belongs to the module's tuning.h\n")
  endforeach()
endmacro()

# Only what is at namespace scope stands at the beginning of a line. A name and a parenthesis make a function.
set(begin "^(static |inline )*(constexpr|const) (static |const )*")
set(numbers "${begin}(long double|double|float|std::[a-z]+<[^(={]*(double|float)[^(={]*>) [^(*&]*[={@]")
set(deduced "${begin}auto [^(*&]*=")
file(GLOB_RECURSE files RELATIVE ${ROOT}/src/splitcubes ${ROOT}/src/splitcubes/*.cpp)
list(SORT files)
foreach(file IN LISTS files)
  math(EXPR checked "${checked} + 1")
  file(STRINGS ${ROOT}/src/splitcubes/${file} some REGEX "^(static |inline )*const")
  if(NOT some)
    continue()
  endif()
  read_lines(${ROOT}/src/splitcubes/${file} lines)
  set(number 0)
  set(statement "")
  foreach(line IN LISTS lines)
    math(EXPR number "${number} + 1")
    if(statement STREQUAL "")
      if(line MATCHES "${numbers}" OR (line MATCHES "${deduced}" AND line MATCHES "[0-9](\\.|e-?[0-9])"))
        set(statement "${line}")
        set(first ${number})
      endif()
    else()
      string(APPEND statement "${line}")
    endif()
    if(statement MATCHES "@")
      check_statement("${statement}" ${first})
      set(statement "")
    endif()
  endforeach()
endforeach()

file(GLOB_RECURSE headers RELATIVE ${ROOT}/src/splitcubes ${ROOT}/src/splitcubes/*tuning.h)
foreach(file IN LISTS headers)
  read_lines(${ROOT}/src/splitcubes/${file} lines)
  set(number 0)
  set(before "")
  foreach(line IN LISTS lines)
    math(EXPR number "${number} + 1")
    if(NOT before MATCHES "^///" AND line MATCHES "^inline constexpr [^=({]* ([A-Za-z0-9_]+) ?[={]")
      string(APPEND problems "src/splitcubes/${file}:${number}: ${CMAKE_MATCH_1} has no comment\n")
    endif()
    set(before "${line}")
  endforeach()
endforeach()

foreach(entry IN LISTS unused)
  string(REPLACE ":" " defines no constant " entry "${entry}")
  string(APPEND problems "tools/constants.txt: ${entry}\n")
endforeach()

if(problems)
  message(NOTICE "${problems}")
  message(FATAL_ERROR "tuning constants stand in the tuning.h of their module, with unit, range and effect")
endif()
message(STATUS "${checked} files: no constant outside of a tuning.h")
