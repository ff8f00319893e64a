// The text of the files in shaders/, carried inside the program.
#pragma once

#include <string_view>

namespace splitcubes::gl {

/// Text of shaders/<file_name> with its includes expanded, empty when there is
/// no such file.
std::string_view shader_source(std::string_view file_name);

}  // namespace splitcubes::gl
