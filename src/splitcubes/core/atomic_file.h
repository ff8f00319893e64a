// Atomic file writes: a target holds the whole new content or is left as it was.
#pragma once

#include <filesystem>
#include <fstream>
#include <ostream>
#include <string_view>

namespace splitcubes {

/// Returns the file that a path finally names: symbolic links are followed; the last one may name a file that
/// does not exist yet. Throws InputError for links that form a cycle.
std::filesystem::path link_target(const std::filesystem::path& path);

/// Throws InputError if no file can be written to the path. Call it before there is anything to write.
void check_file_target(const std::filesystem::path& path);

/// Writes to an unnamed file in the target's folder; commit() names it and renames it to the target. A target
/// that is a symbolic link stays one: the file that it names is replaced. The new file takes over the
/// permissions of the replaced one. Without commit (an exception, a full disk, a kill) the unnamed file is
/// gone and the target is unchanged; a kill between naming and renaming leaves a complete
/// `.splitcubes-N.tmp`. On file systems without unnamed files that name exists from the start, and a kill can
/// leave a partial one, but never a partial target. The file is not synced to the device, so a power cut is
/// not covered.
class AtomicFile {
  public:
    /// Throws InputError if the folder does not exist, the target is not a regular file or its name is too
    /// long, JobError if nothing can be created there.
    explicit AtomicFile(std::filesystem::path path);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    /// Uses the classic locale, whatever the global one is.
    std::ostream& stream() { return stream_; }
    void write(std::string_view bytes);

    /// Closes the file and renames it; at most once. Throws JobError if any byte did not reach the file.
    void commit();

  private:
    void discard();

    std::filesystem::path path_;       // as the caller names it
    std::filesystem::path target_;     // path_ with symbolic links followed
    std::filesystem::path temporary_;  // empty if the file has no name
    std::ofstream stream_;
    int nameless_ = -1;  // file descriptor; -1 if the file has a name
};

/// Writes a whole file at once. Throws as AtomicFile does.
void write_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace splitcubes
