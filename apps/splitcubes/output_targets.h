// Checks whether output files and folders can be written, before any work begins.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace splitcubes::app {

/// Throws InputError if no file can be written under this name: an extension other than those (with their
/// dots; none: any), a missing or read-only folder, a name that is too long, or a folder or a device of that
/// name. Does nothing for an empty path.
void check_output_file(const std::filesystem::path& path, const std::vector<std::string>& endings = {});

/// Checks a folder, which may exist or will be created with its parents.
void check_output_folder(const std::filesystem::path& path);

/// Checks a mesh, whose extension determines the format. The path must not be empty.
void check_mesh_output(const std::filesystem::path& path);
/// Checks a JSON report, of any extension.
inline void check_report_output(const std::filesystem::path& path) {
    check_output_file(path);
}

/// Throws InputError if two of the files are the same: one would overwrite the other. Empty names are
/// skipped.
void check_distinct(const std::vector<std::string>& files);

}  // namespace splitcubes::app
