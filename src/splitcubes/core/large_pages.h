// Large pages of memory, for arrays that would otherwise cost many TLB misses.
#pragma once

#include <cstddef>

namespace splitcubes {

/// Size of a large page, B; smaller arrays gain nothing.
inline constexpr std::size_t large_page = std::size_t{1} << 21;

/// Asks the system to back memory with large pages. Memory must begin and end at multiples of large_page and
/// must not have been written yet. The request is a hint: it has no effect if the system supports no large
/// pages or has none left.
void prefer_large_pages(void* memory, std::size_t bytes);

}  // namespace splitcubes
