// Pages of memory that are looked up less often.
#pragma once

#include <cstddef>

namespace splitcubes {

/// What a large page holds, B; arrays of less gain nothing by it.
inline constexpr std::size_t large_page = std::size_t{1} << 21;

/// Asks the system to back memory that begins and ends at multiples of large_page by large pages, before it
/// is first written. A wish only: where the system knows none or has none left, nothing happens.
void prefer_large_pages(void* memory, std::size_t bytes);

}  // namespace splitcubes
