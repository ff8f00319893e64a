// Files that are there whole or not at all, by the names that they have in io.
#pragma once

#include <splitcubes/core/atomic_file.h>

namespace splitcubes::io {

using splitcubes::AtomicFile;
using splitcubes::write_file;

}  // namespace splitcubes::io
