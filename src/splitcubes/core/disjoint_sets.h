// Union-find.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace splitcubes {

/// Disjoint sets of the indices 0 .. count-1. A set's root is its lowest member, so the result does not
/// depend on the order of the joins.
class DisjointSets {
  public:
    DisjointSets() = default;
    explicit DisjointSets(std::size_t count) { reset(count); }
    /// Makes each index a set by itself.
    void reset(std::size_t count) {
        parent_.resize(count);
        std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
    }
    std::uint32_t find(std::uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(std::uint32_t a, std::uint32_t b) {
        a = find(a);
        b = find(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }

  private:
    std::vector<std::uint32_t> parent_;
};

}  // namespace splitcubes
