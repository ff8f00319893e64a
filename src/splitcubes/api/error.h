// The only exception that calls of the public interface throw.
#pragma once

#include <stdexcept>
#include <string>

namespace splitcubes {

/// Why a call was refused or failed.
enum class ErrorKind {
    invalid_argument,  ///< a value out of range or not finite, a null pointer with a size, a folder that is
                       ///< not there
    unknown_id,        ///< an id of nothing, or of something that has been removed
    pose_not_later,    ///< a pose that is not later than the last one and than the time of the simulation
    busy,              ///< a call beside another one that it may not run beside, also from a callback
    bad_file,          ///< a file that cannot be read, or holds something else
    out_of_memory,  ///< memory ran out; what was to be made is not there. Sizes known to be too large before
                    ///< are invalid_argument
    failed,         ///< a job on good input that could not be done, a file that could not be written
    broken,         ///< an earlier step failed half way: only load, undo and destruction are left
};

/// An error of any call. what() is one line: `where: problem (value); remedy`.
///
/// A call that throws has changed nothing, but for Simulation::step: once it has begun to move things it
/// leaves the simulation half way, and every call but undo, load and destruction throws ErrorKind::broken
/// from then on.
class Error : public std::runtime_error {
  public:
    /// @param kind  why
    /// @param message  one line
    Error(ErrorKind kind, const std::string& message) : std::runtime_error(message), kind_(kind) {}

    /// Why the call was refused or failed.
    ErrorKind kind() const noexcept { return kind_; }

  private:
    ErrorKind kind_;
};

}  // namespace splitcubes
