// Whether files and folders can be written where they are asked for. Commands ask before any
// work begins, so that nothing is computed in vain.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace splitcubes::app {

/// Throws InputError where no file can be written under this name: another ending than those (with
/// their dots; none: any), a missing or read-only folder, a name that is too long, a folder or a
/// device of that name. Does nothing for an empty path.
void check_output_file(const std::filesystem::path& path, const std::vector<std::string>& endings = {});

/// The same for a folder, which may be there or is to be made, those around it too.
void check_output_folder(const std::filesystem::path& path);

/// The same for a mesh, whose ending says the format. The path must not be empty.
void check_mesh_output(const std::filesystem::path& path);
/// The same for a JSON report, of any ending.
inline void check_report_output(const std::filesystem::path& path) {
    check_output_file(path);
}

/// Throws InputError where two of the files are one: what one holds would be lost.
/// Empty names are no files.
void check_distinct(const std::vector<std::string>& files);

}  // namespace splitcubes::app
