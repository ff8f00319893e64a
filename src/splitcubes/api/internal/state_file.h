// A simulation's state in a file.
#pragma once

#include <splitcubes/api/internal/session.h>

#include <string>

namespace splitcubes::api {

/// Throws InputError for what cannot be written, and as write_file.
void write_state_file(const std::string& file, const Snapshot& snapshot);
/// Throws Error (bad_file) for a file that holds no state of this version.
Snapshot read_state_file(const std::string& file, const Parallel& parallel);

}  // namespace splitcubes::api
