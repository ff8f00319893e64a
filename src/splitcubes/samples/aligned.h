// Arrays aligned to cache lines, for aligned vector loads.
#pragma once

#include <splitcubes/core/large_pages.h>

#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace splitcubes::meshless {

/// Allocator with cache-line alignment. Arrays of at least one large page use large pages where the system
/// has them: this shortens an elastic step of 30,000 phyxels by 2 to 10 %.
template <class T>
struct LineAllocator {
    using value_type = T;
    static constexpr std::align_val_t line{64};

    LineAllocator() = default;
    template <class U>
    explicit LineAllocator(const LineAllocator<U>&) {}
    T* allocate(std::size_t count) {
        const std::size_t bytes = count * sizeof(T);
        if (bytes < large_page) return static_cast<T*>(::operator new(bytes, line));
        const std::size_t whole = (bytes + large_page - 1) / large_page * large_page;
        void* const memory = ::operator new (whole, std::align_val_t{large_page});
        prefer_large_pages(memory, whole);
        return static_cast<T*>(memory);
    }
    void deallocate(T* memory, std::size_t count) {
        const bool is_large = count * sizeof(T) >= large_page;
        ::operator delete(memory, is_large ? std::align_val_t{large_page} : line);
    }
    template <class U>
    bool operator==(const LineAllocator<U>&) const {
        return true;
    }
};

/// For large arrays: large pages also make the first write (page faults) much cheaper.
template <class T>
using StreamArray = std::vector<T, LineAllocator<T>>;

using FloatArray = std::vector<float, LineAllocator<float>>;
using IndexArray = std::vector<std::int32_t, LineAllocator<std::int32_t>>;

}  // namespace splitcubes::meshless
