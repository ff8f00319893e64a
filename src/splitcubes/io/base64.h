// Bytes out of base64 text (RFC 4648, section 4). Internal to the module.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

namespace splitcubes::io {

/// Empty optional where the text is not base64; the padding may be left out.
std::optional<std::vector<std::byte>> decode_base64(std::string_view text);

}  // namespace splitcubes::io
