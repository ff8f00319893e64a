// Text of the files in shaders/, embedded in the program.
#pragma once

#include <string_view>

namespace splitcubes::gl {

/// Returns the text of shaders/<file_name> with its includes expanded; empty if there is no such file.
std::string_view shader_source(std::string_view file_name);

}  // namespace splitcubes::gl
