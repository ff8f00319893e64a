// Memory that will soon be read.
#pragma once

namespace splitcubes {

/// Asks for the cache line at an address, if there is one; the program goes on meanwhile. Worth it where
/// addresses follow no line, or one of which processors that look ahead lose sight at each end of a page.
inline void prefetch([[maybe_unused]] const void* address) {
#if defined(__GNUC__)
    __builtin_prefetch(address);
#endif
}

}  // namespace splitcubes
