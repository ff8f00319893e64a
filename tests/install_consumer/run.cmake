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
# What goes with the program.
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
run("running the consumer" ${WORK}/build/consumer)
message(STATUS "${output}")
