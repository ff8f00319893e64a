// Files that are there whole or not at all.
#pragma once

#include <filesystem>
#include <fstream>
#include <ostream>
#include <string_view>

namespace splitcubes::io {

/// Writes to a temporary file in the target's folder, which commit() renames to
/// the target. Without commit (an exception on the way, a full disk) the
/// destructor removes it and what was at the target stays. A crash of the
/// program can leave a `.splitcubes-N.tmp` behind, never half a target. Not
/// synced to the device: a power cut is not covered.
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
    std::filesystem::path path_;
    std::filesystem::path temporary_;
    std::ofstream stream_;
    bool committed_ = false;
};

}  // namespace splitcubes::io
