// Prefetching of memory.
#pragma once

namespace splitcubes {

/// Prefetches the cache line at an address, if there is one, without waiting. It pays for irregular
/// addresses, and for streams at page ends, where hardware prefetchers stop.
inline void prefetch([[maybe_unused]] const void* address) {
#if defined(__GNUC__)
    __builtin_prefetch(address);
#endif
}

}  // namespace splitcubes
