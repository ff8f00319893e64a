#include "output_targets.h"

#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>

#include <unistd.h>

#include <algorithm>
#include <climits>
#include <map>
#include <system_error>

namespace splitcubes::app {

namespace fs = std::filesystem;

namespace {

fs::path folder_of(const fs::path& path) {
    return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

std::string lower_case(std::string text) {
    for (char& c : text)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return text;
}

std::string listed(const std::vector<std::string>& endings) {
    std::string out;
    for (std::size_t k = 0; k < endings.size(); ++k)
        out += (k == 0 ? "" : k + 1 < endings.size() ? ", " : " or ") + endings[k];
    return out;
}

void check_lengths(const fs::path& path, const fs::path& existing_folder) {
    const long limit = ::pathconf(existing_folder.c_str(), _PC_NAME_MAX);
    const std::size_t longest = limit > 0 ? static_cast<std::size_t>(limit) : 255;
    for (const fs::path& part : path)
        if (part.native().size() > longest)
            throw InputError(printable(path.string()),
                             "a name of " + std::to_string(part.native().size()) + " bytes is too long",
                             "this file system takes " + std::to_string(longest));
    if (path.native().size() >= PATH_MAX)
        throw InputError(printable(path.string()),
                         "a path of " + std::to_string(path.native().size()) + " bytes is too long",
                         "the system takes " + std::to_string(PATH_MAX - 1));
}

// Tests by writing, as permissions alone are not conclusive.
void check_writable(const fs::path& path, const fs::path& folder) {
    try {
        check_file_target(folder / ".splitcubes-probe");
    } catch (const InputError&) {
        throw InputError(path.string(), "nothing can be written in the folder " + folder.string(),
                         "write somewhere else");
    }
}

void check_ending(const fs::path& path, const std::vector<std::string>& endings) {
    if (endings.empty()) return;
    const std::string ending = lower_case(path.extension().string());
    if (std::find(endings.begin(), endings.end(), ending) != endings.end()) return;
    throw InputError(path.string(),
                     ending.empty() ? "has no ending" : "has the unknown ending '" + ending + "'",
                     "write to a name that ends in " + listed(endings));
}

}  // namespace

void check_output_file(const fs::path& path, const std::vector<std::string>& endings) {
    if (path.empty()) return;
    std::error_code error;
    if (path.has_filename() && !fs::is_directory(path, error)) check_ending(path, endings);
    check_file_target(path);
}

void check_output_folder(const fs::path& path) {
    if (path.empty()) return;
    check_lengths(path, ".");
    // The nearest existing parent folder.
    fs::path folder = path;
    std::error_code error;
    fs::file_status status = fs::status(folder, error);
    while (status.type() == fs::file_type::not_found) {
        const fs::path around = folder.has_filename() ? folder_of(folder) : folder.parent_path();
        if (around == folder || around.empty()) break;
        folder = around;
        status = fs::status(folder, error);
    }
    if (status.type() != fs::file_type::directory)
        throw InputError(path.string(),
                         status.type() == fs::file_type::none || status.type() == fs::file_type::unknown
                             ? folder.string() + " cannot be entered (" + error.message() + ")"
                         : folder == path ? "is a file"
                                          : folder.string() + " is a file",
                         "give a folder");
    check_lengths(path, folder);
    check_writable(path, folder);
}

void check_mesh_output(const fs::path& path) {
    if (path.empty()) throw InputError("--output", "names no file", "give -o FILE");
    check_output_file(path, {".ply", ".obj", ".stl", ".glb"});
}

void check_distinct(const std::vector<std::string>& files) {
    std::map<fs::path, std::string> seen;
    for (const std::string& file : files) {
        if (file.empty()) continue;
        std::error_code error;
        const fs::path path = fs::weakly_canonical(file, error);
        if (!seen.emplace(error ? fs::path(file) : path, file).second)
            throw InputError(file, "is named twice among the files to read and to write",
                             "give each a name of its own");
    }
}

}  // namespace splitcubes::app
