#include <splitcubes/io/text_encoding.h>

namespace splitcubes::io {

Bytes without_byte_order_mark(Bytes bytes) {
    const std::string_view mark = "\xEF\xBB\xBF";
    return as_text(bytes).starts_with(mark) && !is_binary_stl(bytes) ? bytes.subspan(mark.size()) : bytes;
}

bool is_utf16(Bytes bytes) {
    const std::string_view text = as_text(bytes);
    return (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) && !is_binary_stl(bytes);
}

}  // namespace splitcubes::io
