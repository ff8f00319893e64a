#include <splitcubes/core/error.h>
#include <splitcubes/io/atomic_file.h>

#include <cerrno>
#include <cstdio>
#include <locale>
#include <system_error>
#include <utility>

namespace splitcubes::io {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail_job(const fs::path& path, const std::string& problem, const std::error_code& why) {
    throw JobError(path.string() + ": " + problem + (why ? " (" + why.message() + ")" : ""));
}

std::error_code last_error() {
    return {errno, std::generic_category()};
}

/// Creates a file that did not exist before, so that two writers never share
/// one. Short, as the target's own name may be as long as the file system allows.
fs::path create_temporary(const fs::path& target, const fs::path& folder) {
    constexpr int tries = 10000;
    for (int i = 0; i < tries; ++i) {
        const fs::path candidate = folder / (".splitcubes-" + std::to_string(i) + ".tmp");
        errno = 0;
        if (std::FILE* file = std::fopen(candidate.string().c_str(), "wbx")) {
            std::fclose(file);
            return candidate;
        }
        if (errno != EEXIST) fail_job(target, "cannot write in the folder " + folder.string(), last_error());
    }
    fail_job(target, "too many files .splitcubes-N.tmp in the folder " + folder.string() + "; remove them",
             {});
}

}  // namespace

AtomicFile::AtomicFile(fs::path path) : path_(std::move(path)) {
    const fs::path folder = path_.has_parent_path() ? path_.parent_path() : fs::path(".");
    std::error_code ignored;
    if (!fs::is_directory(folder, ignored))
        throw InputError(path_.string(), "there is no folder " + folder.string(),
                         "create it or write somewhere else");
    if (!path_.has_filename() || fs::is_directory(path_, ignored))
        throw InputError(path_.string(), "is a folder", "give the name of a file");
    // A device or a pipe would be replaced by the file, not written to.
    if (fs::exists(path_, ignored) && !fs::is_regular_file(path_, ignored))
        throw InputError(path_.string(), "is not a regular file", "write to another name");
    temporary_ = create_temporary(path_, folder);
    errno = 0;
    stream_.open(temporary_, std::ios::binary | std::ios::trunc);
    stream_.imbue(std::locale::classic());
    if (!stream_) {
        const std::error_code why = last_error();
        fs::remove(temporary_, ignored);
        fail_job(path_, "cannot be written", why);
    }
}

AtomicFile::~AtomicFile() {
    if (committed_) return;
    stream_.close();
    std::error_code ignored;
    fs::remove(temporary_, ignored);
}

void AtomicFile::write(std::string_view bytes) {
    stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

void AtomicFile::commit() {
    errno = 0;
    stream_.close();
    if (!stream_) fail_job(path_, "could not be written to its end", last_error());
    std::error_code why;
    fs::rename(temporary_, path_, why);
    if (why) fail_job(path_, "cannot be replaced", why);
    committed_ = true;
}

}  // namespace splitcubes::io
