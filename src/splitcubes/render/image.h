// Pictures to and from PNG files.
#pragma once

#include <splitcubes/render/picture.h>

#include <filesystem>

namespace splitcubes::render {

/// Writes beside the target and renames, so that a file of that name is always
/// whole. Throws InputError on an empty picture, JobError when it cannot be written.
void write_png(const std::filesystem::path& path, const Picture& picture);

/// Reads a PNG of any kind as 8-bit RGB. Throws InputError when it cannot be read.
Picture read_png(const std::filesystem::path& path);

}  // namespace splitcubes::render
