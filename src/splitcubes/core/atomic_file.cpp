#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>

#include <cerrno>
#include <cstdio>
#include <locale>
#include <system_error>
#include <utility>

#ifdef __linux__
#include <fcntl.h>
#include <unistd.h>
#endif

namespace splitcubes {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail_job(const fs::path& path, const std::string& problem, const std::error_code& why) {
    throw JobError(path.string() + ": " + problem + (why ? " (" + why.message() + ")" : ""));
}

std::error_code last_error() {
    return {errno, std::generic_category()};
}

/// Calls `create(name)` with names beside the target until it creates one that did not exist before, so two
/// writers never share a file. The names are short, as the target's own name may have the maximum length of
/// the file system. `create` returns false with errno set.
template <typename Create>
fs::path with_free_name(const fs::path& target, const fs::path& folder, const Create& create) {
    constexpr int tries = 10000;
    for (int i = 0; i < tries; ++i) {
        fs::path candidate = folder / (".splitcubes-" + std::to_string(i) + ".tmp");
        errno = 0;
        if (create(candidate)) return candidate;
        if (errno != EEXIST) fail_job(target, "cannot write in the folder " + folder.string(), last_error());
    }
    fail_job(target, "too many files .splitcubes-N.tmp in the folder " + folder.string() + "; remove them",
             {});
}

bool create_new(const fs::path& file) {
    std::FILE* const opened = std::fopen(file.string().c_str(), "wbx");
    if (opened != nullptr) std::fclose(opened);
    return opened != nullptr;
}

fs::path folder_of(const fs::path& file) {
    return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

/// Returns a path to an open file, also if it has no name.
std::string by_descriptor(int descriptor) {
    return "/proc/self/fd/" + std::to_string(descriptor);
}

/// Opens a file without a name, which vanishes with the process; returns -1 if the system or the file system
/// does not support that.
int open_nameless([[maybe_unused]] const fs::path& folder) {
#if defined(__linux__) && defined(O_TMPFILE)
    const int descriptor = ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
    std::error_code ignored;
    if (descriptor >= 0 && !fs::exists(by_descriptor(descriptor), ignored)) {
        ::close(descriptor);
        return -1;
    }
    return descriptor;
#else
    return -1;
#endif
}

bool give_name([[maybe_unused]] int descriptor, [[maybe_unused]] const fs::path& name) {
#ifdef __linux__
    return ::linkat(AT_FDCWD, by_descriptor(descriptor).c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) ==
           0;
#else
    return false;
#endif
}

void close_descriptor([[maybe_unused]] int& descriptor) {
#ifdef __linux__
    if (descriptor >= 0) ::close(descriptor);
#endif
    descriptor = -1;
}

}  // namespace

fs::path link_target(const fs::path& path) {
    constexpr int max_links = 40;  // as the Linux kernel
    fs::path at = path;
    std::error_code error;
    for (int links = 0; fs::is_symlink(fs::symlink_status(at, error)); ++links) {
        const fs::path next = fs::read_symlink(at, error);
        if (error) fail_job(path, "the link cannot be followed", error);
        if (links == max_links)
            throw InputError(path.string(), "is a symbolic link that leads round in a circle",
                             "give another name, or repair the link");
        at = next.is_absolute() ? next : folder_of(at) / next;
    }
    return at;
}

namespace {

// Throws InputError if no file can be written to the target.
void check_target(const fs::path& path, const fs::path& target) {
    const std::string leads = target == path ? "" : " (" + path.string() + " is a link to it)";
    const fs::path folder = folder_of(target);
    std::error_code error;
    if (!fs::is_directory(folder, error))
        throw InputError(target.string() + leads, "there is no folder " + folder.string(),
                         "create it or write somewhere else");
    const fs::file_status status = fs::status(target, error);
    if (!target.has_filename() || fs::is_directory(status))
        throw InputError(path.string(), "is a folder", "give the name of a file");
    if (error == std::errc::filename_too_long)
        throw InputError(
            path.string(),
            "the name is too long (" + std::to_string(target.filename().string().size()) + " bytes)",
            "give a shorter one");
    // Renaming would replace a device or a pipe instead of writing to it.
    if (fs::exists(status) && !fs::is_regular_file(status))
        throw InputError(path.string(), "is not a regular file", "write to another name");
}

// Returns the checked target of a path.
fs::path file_target(const fs::path& path) {
    std::error_code ignored;
    const fs::file_status status = fs::status(path, ignored);
    // A link in /proc to a pipe has no name to follow.
    const bool special = fs::exists(status) && !fs::is_regular_file(status);
    fs::path target = special ? path : link_target(path);
    check_target(path, target);
    return target;
}

}  // namespace

void check_file_target(const fs::path& path) {
    const fs::path folder = folder_of(file_target(path));
    int descriptor = open_nameless(folder);
    if (descriptor >= 0) {
        close_descriptor(descriptor);
        return;
    }
    try {
        fs::remove(with_free_name(path, folder, create_new));
    } catch (const JobError& error) {
        const std::string name = path.string(), text = error.what();
        throw InputError(name, text.substr(name.size() + 2), "write to another folder");
    }
}

AtomicFile::AtomicFile(fs::path path) : path_(std::move(path)), target_(file_target(path_)) {
    const fs::path folder = folder_of(target_);
    nameless_ = open_nameless(folder);
    if (nameless_ < 0) temporary_ = with_free_name(path_, folder, create_new);
    errno = 0;
    stream_.open(nameless_ < 0 ? temporary_.string() : by_descriptor(nameless_),
                 std::ios::binary | std::ios::trunc);
    stream_.imbue(std::locale::classic());
    if (!stream_) {
        const std::error_code why = last_error();
        discard();
        fail_job(path_, "cannot be written", why);
    }
}

AtomicFile::~AtomicFile() {
    stream_.close();
    discard();
}

void AtomicFile::discard() {
    close_descriptor(nameless_);
    std::error_code ignored;
    if (!temporary_.empty()) fs::remove(temporary_, ignored);
    temporary_.clear();
}

void AtomicFile::write(std::string_view bytes) {
    stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

void AtomicFile::commit() {
    errno = 0;
    stream_.close();
    if (!stream_) fail_job(path_, "could not be written to its end", last_error());
    // Linking fails if the target exists, so the file gets a temporary name first and is then renamed.
    if (nameless_ >= 0)
        temporary_ = with_free_name(path_, folder_of(target_),
                                    [&](const fs::path& name) { return give_name(nameless_, name); });
    std::error_code why;
    const fs::file_status replaced = fs::status(target_, why);
    // Permissions of another owner's file cannot always be copied; that is no error.
    if (fs::exists(replaced)) fs::permissions(temporary_, replaced.permissions(), why);
    fs::rename(temporary_, target_, why);
    if (why) fail_job(path_, "cannot be replaced", why);
    temporary_.clear();
}

void write_file(const fs::path& path, std::string_view bytes) {
    AtomicFile file(path);
    file.write(bytes);
    file.commit();
}

}  // namespace splitcubes
