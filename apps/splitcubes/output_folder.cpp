#include "output_folder.h"

#include "command_line.h"
#include "report.h"

#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iostream>
#include <system_error>

namespace splitcubes::app {

namespace fs = std::filesystem;

namespace {

constexpr const char* list_name = "splitcubes-files.txt";
constexpr std::uintmax_t longest_list = std::uintmax_t{1} << 28;  // bytes

bool all_digits(const std::string& text) {
    return !text.empty() && text.find_first_not_of("0123456789") == text.npos;
}

bool is_frame(const fs::path& name, std::initializer_list<const char*> endings) {
    const std::string stem = name.stem().string(), ending = name.extension().string();
    return stem.size() >= 6 && all_digits(stem) &&
           std::find(endings.begin(), endings.end(), ending) != endings.end();
}

// bodyK-NAME: a picture embedded in a mesh, see AttributedSurfaces.
bool is_picture_of_a_mesh(const std::string& file) {
    const std::string start = "body";
    const std::size_t dash = std::min(file.find('-'), file.size());
    return file.starts_with(start) && dash > start.size() && dash < file.size() &&
           all_digits(file.substr(start.size(), dash - start.size()));
}

// Folders of inputs are named by their content's hash.
bool is_content(const std::string& name) {
    return name.size() == 16 && name.find_first_not_of("0123456789abcdef") == name.npos;
}

bool is_run_file(const fs::path& name) {
    const std::string folder = name.parent_path().string(), file = name.filename().string();
    if (folder.empty())
        return file == "scene.json" || file == "scene_as_run.json" || file == "metrics.csv" ||
               file == "summary.json" || file == "checkpoint.bin";
    if (folder == "surface")
        return is_frame(name, {".ply", ".obj", ".stl", ".glb", ".mtl"}) || is_picture_of_a_mesh(file);
    if (folder == "pictures") return is_frame(name, {".png"});
    if (folder == "links") return is_frame(name, {".ply"});
    const auto part = name.begin();
    return *part == "inputs" && is_content(std::next(part)->string());
}

bool is_piece_file(const fs::path& name) {
    const std::string stem = name.stem().string();
    const std::size_t dash = stem.find('-');
    const std::string ending = name.extension().string();
    const bool is_mesh =
        ending == ".ply" || ending == ".obj" || ending == ".mtl" || ending == ".stl" || ending == ".glb";
    if (name.has_parent_path() || !is_mesh || dash == stem.npos || stem.size() < dash + 5) return false;
    const std::string what = stem.substr(0, dash);
    return (what == "piece" || what == "removed") && all_digits(stem.substr(dash + 1));
}

bool is_picture_file(const fs::path& name) {
    return !name.has_parent_path() && is_frame(name, {".png"});
}

std::string head_of(const FolderKind& kind) {
    return std::string("splitcubes files 1: ") + kind.name;
}

// A list may be forged: its names must not lead out of the folder.
bool is_within(const fs::path& name) {
    return !name.empty() && name.is_relative() &&
           std::none_of(name.begin(), name.end(), [](const fs::path& part) { return part == ".."; });
}

// Returns whether a killed process's AtomicFile may have left a file of this name.
bool is_leftover(const std::string& name) {
    const std::string start = ".splitcubes-", ending = ".tmp";
    return name.starts_with(start) && name.ends_with(ending) &&
           all_digits(name.substr(start.size(), name.size() - start.size() - ending.size()));
}

std::string count_files(std::size_t files) {
    return std::to_string(files) + (files == 1 ? " file" : " files");
}

std::string counted_entries(std::size_t entries) {
    return std::to_string(entries) + (entries == 1 ? " file or folder" : " files or folders");
}

std::string and_more(std::size_t files) {
    return files < 2 ? "" : " and " + std::to_string(files - 1) + " more";
}

[[noreturn]] void fail_writing(const fs::path& file) {
    throw JobError(file.string() + ": cannot be written (" + std::generic_category().message(errno) + ")");
}

}  // namespace

const FolderKind run_folder{"run", "files of a run", {"surface", "pictures", "links", "inputs"}, is_run_file};
const FolderKind pieces_folder{"pieces", "pieces of a cut", {}, is_piece_file};
const FolderKind pictures_folder{"pictures", "pictures of a run", {}, is_picture_file};

void add_force_option(Command& command, bool& force, const FolderKind& kind) {
    command.add_flag("--force", force,
                     "Writes also into a folder that has other files: those with the names of " +
                         std::string(kind.files) + " are replaced, the others stay");
}

OutputFolder::Descriptor::~Descriptor() {
    if (value >= 0) ::close(value);
}

OutputFolder::MadeFolders::~MadeFolders() {
    std::error_code ignored;
    for (auto folder = folders.rbegin(); folder != folders.rend(); ++folder) fs::remove(*folder, ignored);
}

OutputFolder::OutputFolder(fs::path folder, const FolderKind& kind, bool force,
                           std::span<const fs::path> read)
    : path_(std::move(folder)), kind_(kind) {
    make();
    lock();
    const bool has_list = read_list();
    find_named_alike(read);
    if (!has_list && !force) refuse_others();
    const std::string where = "is named as " + std::string(kind_.files) + " are, but ";
    if (!immovable_.empty())
        throw InputError((path_ / immovable_.begin()->first).string() + and_more(immovable_.size()),
                         where + immovable_.begin()->second, "move it away, or give another folder");
    if (!replaced_.empty() && !force)
        throw InputError((path_ / *replaced_.begin()).string() + and_more(replaced_.size()),
                         where + "this program did not write it (" + list_name + " does not list it)",
                         "move it away, give another folder, or --force to replace it");
    if (others_.empty() || !replaced_.empty()) return;
    std::cerr << path_.string() << ": " << counted_entries(others_.size())
              << " that this program did not write "
              << (others_.size() == 1 ? "stays as it is\n" : "stay as they are\n");
}

void OutputFolder::make() {
    fs::path target = link_target(path_);
    if (!target.has_filename()) target = target.parent_path();
    std::error_code error;
    std::vector<fs::path> missing;
    for (fs::path at = target; !at.empty() && !fs::exists(at, error); at = at.parent_path())
        missing.push_back(at);
    error.clear();
    for (auto at = missing.rbegin(); at != missing.rend() && !error; ++at)
        if (fs::create_directory(*at, error)) made_.folders.push_back(*at);
    std::error_code ignored;
    const bool is_folder = fs::is_directory(target, ignored);
    if (error || !is_folder)
        throw InputError(path_.string(), "cannot be made: " + (error ? error.message() : "it is a file"),
                         "give a folder that can be written to");
    check_file_target(target / list_name);
}

void OutputFolder::lock() {
    for (;;) {
        Descriptor folder{::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
        struct stat opened {
        }, named{};
        const bool is_open = folder.value >= 0 && ::fstat(folder.value, &opened) == 0;
        if (!is_open && errno != ENOENT)
            throw InputError(path_.string(), "cannot be opened: " + std::generic_category().message(errno),
                             "give a folder that can be read and written");
        const int refusal = is_open && ::flock(folder.value, LOCK_EX | LOCK_NB) != 0 ? errno : 0;
        if (refusal == EWOULDBLOCK)
            throw InputError(path_.string(), "another process is writing into it",
                             "wait until that has ended, or give another folder");
        // The previous owner of the lock may have removed the folder.
        if (is_open && ::stat(path_.c_str(), &named) == 0 && named.st_ino == opened.st_ino &&
            named.st_dev == opened.st_dev) {
            std::swap(lock_.value, folder.value);
            if (refusal != 0)
                print_notes(path_.string(),
                            {"cannot be locked here (" + std::generic_category().message(refusal) +
                             "): a second command writing into it cannot be detected"});
            return;
        }
        make();
    }
}

bool OutputFolder::is_own_folder(const fs::path& name) const {
    return std::find(kind_.folders.begin(), kind_.folders.end(), *name.begin()) != kind_.folders.end();
}

bool OutputFolder::read_list() {
    const fs::path file = path_ / list_name;
    std::error_code error;
    if (!fs::exists(fs::symlink_status(file, error))) {
        for (const auto& entry : fs::directory_iterator(path_, error))
            if (!is_leftover(entry.path().filename().string()))
                others_.insert(entry.path().filename().string());
        return false;
    }
    if (!fs::is_regular_file(fs::symlink_status(file, error)) || fs::file_size(file, error) > longest_list)
        throw InputError(file.string(), "is not a list of files", "move it away, or give another folder");
    std::ifstream stream(file, std::ios::binary);
    std::string line;
    std::getline(stream, line);
    if (line != head_of(kind_))
        throw InputError(path_.string(),
                         "holds other files than " + std::string(kind_.files) + " (" + list_name +
                             " says \"" + printable(line) + "\")",
                         "give another folder");
    // A truncated last line has no line end; its file was never started.
    while (std::getline(stream, line) && !stream.eof())
        if (is_within(line) && (line.ends_with('/') ? is_own_folder(line) : kind_.is_own(line)))
            names_.insert(line);
    return true;
}

void OutputFolder::refuse_others() const {
    if (others_.empty()) return;
    const std::string first = replaced_.empty() ? *others_.begin() : *replaced_.begin();
    throw InputError(
        path_.string(),
        "holds " + counted_entries(others_.size()) + " that this program did not write (" + printable(first) +
            ")",
        replaced_.empty()
            ? "give an empty or a new folder, or --force to write beside them"
            : "give an empty or a new folder, or --force to write beside them and replace those with the "
              "names of " +
                  std::string(kind_.files));
}

bool OutputFolder::may_write(const fs::path& file) const {
    std::error_code error;
    const fs::path name = fs::weakly_canonical(file, error).lexically_relative(fs::canonical(path_, error));
    return !error && is_within(name) && (name == list_name || kind_.is_own(name));
}

bool OutputFolder::is_listed_file(const std::string& name) const {
    std::error_code error;
    return names_.contains(name) && fs::is_regular_file(fs::symlink_status(path_ / name, error));
}

// Returns whether the file exists without a link on its path.
bool OutputFolder::is_here(const fs::path& name) const {
    std::error_code error;
    const fs::path folder = name.parent_path(), here = fs::canonical(path_, error);
    return folder.empty() || fs::weakly_canonical(path_ / folder, error) == here / folder;
}

void OutputFolder::look_at(const fs::path& file, std::span<const fs::path> read) {
    std::error_code error;
    const fs::path name = file.lexically_relative(path_);
    const std::string text = name.generic_string();
    const fs::file_status status = fs::symlink_status(file, error);
    const bool inner = name.has_parent_path() && *name.begin() == "inputs" && fs::is_directory(status);
    if (inner || !kind_.is_own(name) || is_listed_file(text)) return;
    const bool is_read = std::any_of(read.begin(), read.end(),
                                     [&](const fs::path& one) { return fs::equivalent(one, file, error); });
    if (!fs::is_regular_file(status))
        immovable_[text] = "is not a plain file";
    else if (!is_here(name))
        immovable_[text] = "lies behind a link, and this program did not write it";
    else if (is_read)
        immovable_[text] = "this command reads it, and this program did not write it";
    else
        replaced_.insert(text);
}

void OutputFolder::find_named_alike(std::span<const fs::path> read) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(path_, error)) look_at(entry.path(), read);
    for (const char* folder : kind_.folders) {
        const fs::path inner = path_ / folder;
        if (fs::exists(fs::symlink_status(inner, error)) && !fs::is_directory(inner, error))
            immovable_[folder] = "is not a folder";
        for (auto at = fs::recursive_directory_iterator(inner, error);
             at != fs::recursive_directory_iterator(); at.increment(error))
            look_at(at->path(), read);
    }
}

void OutputFolder::remove_replaced() {
    std::error_code error;
    for (const std::string& name : replaced_)
        if (is_here(name) && fs::is_regular_file(fs::symlink_status(path_ / name, error)) &&
            !fs::remove(path_ / name, error))
            fail_writing(path_ / name);
    if (!replaced_.empty())
        std::cerr << path_.string() << ": replaced " << count_files(replaced_.size())
                  << " that this program did not write (" << printable(*replaced_.begin())
                  << and_more(replaced_.size()) << "); others stay as they are\n";
    replaced_.clear();
}

void OutputFolder::remove_leftovers(const std::string& folder) const {
    std::error_code error;
    std::vector<fs::path> leftovers;
    if (!folder.empty() && !is_here(fs::path(folder) / "any")) return;
    for (const auto& entry : fs::directory_iterator(path_ / folder, error))
        if (is_leftover(entry.path().filename().string()) && fs::is_regular_file(entry.symlink_status(error)))
            leftovers.push_back(entry.path());
    for (const fs::path& file : leftovers) fs::remove(file, error);
}

void OutputFolder::clear(const std::function<bool(const std::string&)>& keep) {
    remove_replaced();
    std::set<std::string> kept;
    std::error_code error;
    // Without a list the folder may be one where others write.
    if (!names_.empty()) remove_leftovers("");
    for (const std::string& name : names_)
        if (name.ends_with('/')) remove_leftovers(name.substr(0, name.size() - 1));
    for (const std::string& name : names_)
        if (is_listed_file(name) && (keep(name) || !is_here(name) || !fs::remove(path_ / name, error)))
            kept.insert(name);
    // Removes inner folders before outer ones; those that are not empty stay.
    for (auto name = names_.rbegin(); name != names_.rend(); ++name) {
        if (!name->ends_with('/')) continue;
        const fs::path folder = name->substr(0, name->size() - 1);
        const bool is_folder = fs::is_directory(fs::symlink_status(path_ / folder, error));
        if (is_folder && (!is_here(folder) || !fs::remove(path_ / folder, error))) kept.insert(*name);
    }
    names_ = std::move(kept);
    std::string text = head_of(kind_) + '\n';
    for (const std::string& name : names_) text += name + '\n';
    write_file(path_ / list_name, text);
    list_.value = ::open((path_ / list_name).c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
    if (list_.value < 0) fail_writing(path_ / list_name);
}

void OutputFolder::append(const std::string& name) {
    if (!names_.insert(name).second) return;
    const std::string line = name + '\n';
    errno = 0;
    if (::write(list_.value, line.data(), line.size()) != static_cast<ssize_t>(line.size()))
        fail_writing(path_ / list_name);
}

fs::path OutputFolder::add(const std::string& name) {
    for (std::size_t slash = name.find('/'); slash != name.npos; slash = name.find('/', slash + 1)) {
        const std::string folder = name.substr(0, slash);
        if (!there_.insert(folder).second) continue;
        std::error_code error;
        if (fs::is_directory(path_ / folder, error)) continue;
        append(folder + '/');
        fs::create_directory(path_ / folder, error);
        if (error)
            throw JobError((path_ / folder).string() + ": the folder cannot be made (" + error.message() +
                           ")");
    }
    append(name);
    return path_ / name;
}

}  // namespace splitcubes::app
