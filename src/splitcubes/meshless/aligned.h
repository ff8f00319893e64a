// Arrays that begin at a cache line, for loads of whole vector registers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace splitcubes::meshless {

/// std::allocator but for the place where the memory begins.
template <class T>
struct LineAllocator {
    using value_type = T;
    static constexpr std::align_val_t line{64};

    LineAllocator() = default;
    template <class U>
    explicit LineAllocator(const LineAllocator<U>&) {}
    T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), line)); }
    void deallocate(T* memory, std::size_t) { ::operator delete(memory, line); }
    template <class U>
    bool operator==(const LineAllocator<U>&) const {
        return true;
    }
};

using FloatArray = std::vector<float, LineAllocator<float>>;
using IndexArray = std::vector<std::int32_t, LineAllocator<std::int32_t>>;

}  // namespace splitcubes::meshless
