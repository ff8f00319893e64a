// Errors by kind: bad input is an InputError, a failed job (disk full, no encoder) a JobError, a programmer's
// error an assert. Numerical trouble is never an exception but a count in a report.
#pragma once

#include <stdexcept>
#include <string>

namespace splitcubes {

/// Input that cannot be used: a mesh, a scene, an option. what() is one line: `location: problem (value);
/// remedy`. The program ends with exit code 2.
class InputError : public std::runtime_error {
  public:
    /// location: file (with :line if known), option or parameter. problem: the fault, with the offending
    /// value. remedy: what the user can do; may be empty.
    InputError(const std::string& location, const std::string& problem, const std::string& remedy = "");
};

/// A job on good input that could not be finished. The program ends with exit code 1.
class JobError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// Replaces control characters and truncates text longer than `limit` bytes, so that text from a file can
/// stand in a one-line message.
std::string printable(const std::string& text, std::size_t limit = 60);

}  // namespace splitcubes
