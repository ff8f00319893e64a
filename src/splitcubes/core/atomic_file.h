// Files that are there whole or not at all.
#pragma once

#include <filesystem>
#include <fstream>
#include <ostream>
#include <string_view>

namespace splitcubes {

/// The file that a path names in the end: symbolic links are followed, to a name that may not be there yet.
/// Throws InputError for links that go round in a circle.
std::filesystem::path link_target(const std::filesystem::path& path);

/// Throws InputError where a file could not be written to that path, before there is anything to write.
void check_file_target(const std::filesystem::path& path);

/// Writes to a file without a name in the target's folder, which commit() names
/// and renames to the target. A target that is a symbolic link stays one: the file that it names is replaced.
/// What is replaced hands on its permissions. Without commit (an exception on the way, a full
/// disk, a kill) it is gone and what was at the target stays; a kill between
/// the two names leaves a whole `.splitcubes-N.tmp`. Where the file system has
/// no nameless files that name is there from the start, and a kill can leave a
/// part of it, never half a target. Not synced to the device: a power cut is
/// not covered.
class AtomicFile {
  public:
    /// Throws InputError when the folder does not exist, the target is no regular file or its name is
    /// too long, JobError when nothing can be created there.
    explicit AtomicFile(std::filesystem::path path);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    /// In the classic locale, whatever the global one is.
    std::ostream& stream() { return stream_; }
    void write(std::string_view bytes);

    /// Closes and renames; at most once. Throws JobError when anything did not reach the file.
    void commit();

  private:
    void discard();

    std::filesystem::path path_;       // as the caller names it
    std::filesystem::path target_;     // what that leads to
    std::filesystem::path temporary_;  // empty: there is no such name
    std::ofstream stream_;
    int nameless_ = -1;  // descriptor
};

/// The whole of it at once. Throws as AtomicFile does.
void write_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace splitcubes
