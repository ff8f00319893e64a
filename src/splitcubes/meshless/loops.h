// Loops over phyxels: one chunk size, no allocation.
#pragma once

#include <splitcubes/core/parallel.h>

#include <functional>
#include <vector>

namespace splitcubes::meshless {

/// Phyxels a chunk: some ten microseconds of work. Part of the result (sums are
/// added chunk by chunk), so it is a constant.
inline constexpr std::size_t phyxel_grain = 128;

/// parallel.for_chunks by reference: std::function would copy a large closure to the heap.
template <class Body>
void for_phyxel_chunks(const Parallel& parallel, std::size_t count, const Body& body) {
    parallel.for_chunks(count, phyxel_grain, std::cref(body));
}

template <class Body>
void for_phyxels(const Parallel& parallel, std::size_t count, const Body& body) {
    for_phyxel_chunks(parallel, count, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) body(i);
    });
}

/// Sums in chunk order, with a buffer that is kept.
class ChunkSum {
  public:
    /// chunk_value(begin, end) -> double; may write per-phyxel results on the way.
    template <class ChunkValue>
    double operator()(const Parallel& parallel, std::size_t count, const ChunkValue& chunk_value) {
        partial_.assign((count + phyxel_grain - 1) / phyxel_grain, 0.0);
        for_phyxel_chunks(parallel, count, [&](std::size_t begin, std::size_t end) {
            partial_[begin / phyxel_grain] = chunk_value(begin, end);
        });
        double total = 0;
        for (const double value : partial_) total += value;
        return total;
    }

  private:
    std::vector<double> partial_;
};

}  // namespace splitcubes::meshless
