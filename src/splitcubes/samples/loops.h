// Loops over phyxels: one chunk size, no allocation.
#pragma once

#include <splitcubes/core/parallel.h>

#include <algorithm>
#include <functional>
#include <vector>

namespace splitcubes::meshless {

/// Phyxels per chunk: about ten microseconds of work. Results depend on it (sums are
/// added chunk by chunk), so it is a constant.
inline constexpr std::size_t phyxel_grain = 128;

/// Calls parallel.for_chunks with a reference to `body`: std::function would copy a large closure to the
/// heap.
template <class Body>
void for_phyxel_chunks(const Parallel& parallel, std::size_t count, const Body& body) {
    parallel.for_chunks(count, phyxel_grain, std::cref(body));
}

/// Calls body(i) for each index. The result must not depend on the chunks, which are few enough that their
/// overhead is small.
template <class Body>
void for_phyxels(const Parallel& parallel, std::size_t count, const Body& body) {
    const auto chunk = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) body(i);
    };
    parallel.for_chunks(count, std::clamp<std::size_t>(count / 64, phyxel_grain, 1024), std::cref(chunk));
}

/// Deterministic parallel sum in chunk order, with a persistent buffer. Value{} must be zero.
template <class Value>
class ChunkSumOf {
  public:
    /// chunk_value(begin, end) -> Value; it may also write results per index.
    template <class ChunkValue>
    Value operator()(const Parallel& parallel, std::size_t count, std::size_t grain,
                     const ChunkValue& chunk_value) {
        partial_.assign((count + grain - 1) / grain, Value{});
        const auto chunk = [&](std::size_t begin, std::size_t end) {
            partial_[begin / grain] = chunk_value(begin, end);
        };
        parallel.for_chunks(count, grain, std::cref(chunk));
        Value total{};
        for (const Value& value : partial_) total += value;
        return total;
    }

  private:
    std::vector<Value> partial_;
};

/// The same for doubles over phyxels, in chunks of phyxel_grain.
class ChunkSum {
  public:
    template <class ChunkValue>
    double operator()(const Parallel& parallel, std::size_t count, const ChunkValue& chunk_value) {
        return sum_(parallel, count, phyxel_grain, chunk_value);
    }

  private:
    ChunkSumOf<double> sum_;
};

}  // namespace splitcubes::meshless
