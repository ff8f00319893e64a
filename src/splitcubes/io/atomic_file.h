// Files that are there whole or not at all.
#pragma once

#include <filesystem>
#include <fstream>
#include <ostream>
#include <string_view>

namespace splitcubes::io {

/// Writes to a file without a name in the target's folder, which commit() names
/// and renames to the target. Without commit (an exception on the way, a full
/// disk, a kill) it is gone and what was at the target stays; a kill between
/// the two names leaves a whole `.splitcubes-N.tmp`. Where the file system has
/// no nameless files that name is there from the start, and a kill can leave a
/// part of it, never half a target. Not synced to the device: a power cut is
/// not covered.
class AtomicFile {
  public:
    /// Throws InputError when the folder does not exist or the target is a
    /// folder, JobError when nothing can be created there.
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

    std::filesystem::path path_;
    std::filesystem::path temporary_;  // empty: there is no such name
    std::ofstream stream_;
    int nameless_ = -1;  // descriptor
};

/// The whole of it at once. Throws as AtomicFile does.
void write_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace splitcubes::io
