// Checksum of stored bytes, against damage by accident.
#pragma once

#include <cstdint>
#include <string_view>

namespace splitcubes {

/// Returns the StateHash of the bytes, read as 64-bit words of this machine's byte order, then single bytes.
/// It protects against damage, not against an author who recomputes it.
std::uint64_t checksum(std::string_view bytes);

}  // namespace splitcubes
