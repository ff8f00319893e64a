# Installs BUILD below WORK, then configures, builds and runs CONSUMER against it.
cmake_minimum_required(VERSION 3.22)

function(run what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT code EQUAL 0)
    message(NOTICE "${output}")
    message(FATAL_ERROR "${what} failed (${code})")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
run("installing (is everything built?)"
  ${CMAKE_COMMAND} --install ${BUILD} --config ${CONFIG} --prefix ${WORK}/prefix)
# Manual and completions come with the program.
if(EXISTS ${WORK}/prefix/bin/splitcubes)
  foreach(file man/man1/splitcubes.1 bash-completion/completions/splitcubes
      zsh/site-functions/_splitcubes fish/vendor_completions.d/splitcubes.fish)
    file(SIZE ${WORK}/prefix/share/${file} size)
    if(size LESS 1000)
      message(FATAL_ERROR "share/${file} is empty")
    endif()
  endforeach()
endif()
# The package must be found below the prefix and nowhere else: the registries and
# the build tree are left out of the search.
run("configuring the consumer"
  ${CMAKE_COMMAND} -S ${CONSUMER} -B ${WORK}/build -G ${GENERATOR}
  -DCMAKE_BUILD_TYPE=${CONFIG} -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_PREFIX_PATH=${WORK}/prefix
  -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF -DEXPECTED_PREFIX=${WORK}/prefix)
run("building the consumer" ${CMAKE_COMMAND} --build ${WORK}/build --config ${CONFIG})
run("running the consumer" ${WORK}/build/consumer ${SOURCE}/scenes/meshes/pear.obj ${WORK}/cmake.state)
message(STATUS "${output}")

# Nothing but the public headers, each of which can be read alone and needs no other library's.
file(GLOB_RECURSE headers RELATIVE ${WORK}/prefix/include ${WORK}/prefix/include/*)
foreach(header IN LISTS headers)
  if(NOT header MATCHES "^splitcubes/api/[a-z_]+\\.h$")
    message(FATAL_ERROR "${header} is installed but not public")
  endif()
  file(WRITE ${WORK}/header.cpp "#include <${header}>\n")
  run("reading ${header} alone" ${COMPILER} -std=c++20 -Wall -Wextra -Wpedantic -Werror -fsyntax-only
    -I${WORK}/prefix/include ${WORK}/header.cpp)
endforeach()

# By pkg-config, from a prefix that has been moved.
file(RENAME ${WORK}/prefix ${WORK}/moved)
file(GLOB_RECURSE pc_file ${WORK}/moved/*/splitcubes.pc)
get_filename_component(pc_folder ${pc_file} DIRECTORY)
set(ENV{PKG_CONFIG_PATH} ${pc_folder})
run("asking pkg-config" pkg-config --cflags --libs splitcubes)
string(STRIP "${output}" flags)
separate_arguments(flags UNIX_COMMAND "${flags}")
run("building by pkg-config" ${COMPILER} -std=c++20 ${CONSUMER}/main.cpp -o ${WORK}/by_pkg_config ${flags})
run("running what pkg-config built" ${WORK}/by_pkg_config ${SOURCE}/scenes/meshes/pear.obj ${WORK}/pc.state)

# Inside of another project: the headers and one archive stand for the whole build.
run("configuring the project around it" ${CMAKE_COMMAND} -S ${EMBEDDED} -B ${WORK}/embedded -G ${GENERATOR}
  -DCMAKE_BUILD_TYPE=${CONFIG} -DCMAKE_CXX_COMPILER=${COMPILER} -DSPLITCUBES_SOURCE=${SOURCE} -DCONSUMER=${CONSUMER})
run("building the project around it" ${CMAKE_COMMAND} --build ${WORK}/embedded --config ${CONFIG} --target around splitcubes_core)
