# Carries the files of shaders/ inside the program, as the function
# gl::shader_source of src/splitcubes/gl/shader_source.h. Included by the build it
# defines splitcubes_embed_shaders(TARGET); run as a script, with -DSHADER_DIR and
# -DOUTPUT, it writes that source.
if(CMAKE_SCRIPT_MODE_FILE)
  file(GLOB files ${SHADER_DIR}/*.vert ${SHADER_DIR}/*.frag ${SHADER_DIR}/*.geom ${SHADER_DIR}/*.comp)
  list(SORT files)
  set(entries "")
  foreach(file IN LISTS files)
    get_filename_component(name ${file} NAME)
    file(READ ${file} text)
    # Lines `#include "other.glsl"` are replaced by that file, to any depth.
    set(depth 0)
    while(text MATCHES "#include \"([a-z_0-9]+\\.glsl)\"")
      set(line "${CMAKE_MATCH_0}")
      file(READ ${SHADER_DIR}/${CMAKE_MATCH_1} included)
      string(REPLACE "${line}" "${included}" text "${text}")
      math(EXPR depth "${depth} + 1")
      if(depth GREATER 20)
        message(FATAL_ERROR "${name}: includes go round in a circle")
      endif()
    endwhile()
    string(APPEND entries "    {\"${name}\", R\"glsl(${text})glsl\"},\n")
  endforeach()
  file(WRITE ${OUTPUT} "// Written by cmake/EmbedShaders.cmake.
#include <splitcubes/gl/shader_source.h>

namespace splitcubes::gl {
namespace {
struct Entry {
    std::string_view name;
    std::string_view text;
};
constexpr Entry entries[] = {
${entries}};
}  // namespace

std::string_view shader_source(std::string_view file_name) {
    for (const Entry& entry : entries) {
        if (entry.name == file_name) return entry.text;
    }
    return {};
}
}  // namespace splitcubes::gl
")
  return()
endif()

set(_embed_shaders_script ${CMAKE_CURRENT_LIST_FILE})
function(splitcubes_embed_shaders target)
  set(output ${CMAKE_CURRENT_BINARY_DIR}/${target}_shaders.cpp)
  file(GLOB inputs CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/shaders/*)
  add_custom_command(OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -DSHADER_DIR=${PROJECT_SOURCE_DIR}/shaders -DOUTPUT=${output}
            -P ${_embed_shaders_script}
    DEPENDS ${inputs} ${_embed_shaders_script} VERBATIM)
  target_sources(${target} PRIVATE ${output})
endfunction()
