// PNG files.
#pragma once

#include <splitcubes/render/picture.h>

#include <filesystem>

namespace splitcubes::render {

/// Writes beside the target and renames, so a file of that name is always complete. Throws InputError for an
/// empty picture, JobError if it cannot be written.
void write_png(const std::filesystem::path& path, const Picture& picture);

/// Reads any kind of PNG as 8-bit RGB. Throws InputError if it cannot be read.
Picture read_png(const std::filesystem::path& path);

}  // namespace splitcubes::render
