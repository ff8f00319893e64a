// Marks of encoding that text editors put before a text. Internal to the module.
#pragma once

#include <splitcubes/io/mesh_readers.h>

namespace splitcubes::io {

/// Without the mark that says a text is UTF-8. A binary STL keeps all its bytes.
Bytes without_byte_order_mark(Bytes bytes);

/// Whether a mark says that it is text in UTF-16.
bool is_utf16(Bytes bytes);

}  // namespace splitcubes::io
