// Parallel loops whose results do not depend on the number of threads: work is divided into chunks of a fixed
// size, one thread runs a chunk in index order, and reductions add the chunks' results in chunk order.
#pragma once

#include <splitcubes/core/monitor.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace splitcubes {

/// Thread pool for loops. It is passed to the functions that need it; there is no global one.
class Parallel {
  public:
    /// thread_count 0: the number of hardware threads.
    explicit Parallel(int thread_count = 0);
    ~Parallel();
    Parallel(Parallel&&) noexcept;
    Parallel& operator=(Parallel&&) noexcept;

    int thread_count() const;

    /// Sets the monitor. Loops report their progress to it and throw Cancelled at the next chunk once it is
    /// cancelled. nullptr, the default, turns both off. The monitor must outlive its use.
    void watch(Monitor* monitor);
    /// Announces the next stage to the monitor, if there is one; throws Cancelled.
    void begin(const std::string& stage) const;
    /// Throws Cancelled if the monitor is cancelled; for long work outside loops.
    void check() const;

    /// Calls body(begin, end) for consecutive chunks of at most `grain` indices of [0, count). Chunks run
    /// concurrently and in any order.
    void for_chunks(std::size_t count, std::size_t grain,
                    const std::function<void(std::size_t, std::size_t)>& body) const;

    /// Calls body(i) for each i of [0, count), in chunks of `grain` consecutive indices.
    template <class Body>
    void for_each(std::size_t count, std::size_t grain, const Body& body) const {
        for_chunks(count, grain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) body(i);
        });
    }

    /// Returns the sum of chunk_value(begin, end) over the chunks, added in chunk order: the same bits for
    /// any number of threads.
    template <class Value, class ChunkValue>
    Value sum(std::size_t count, std::size_t grain, const Value& zero, const ChunkValue& chunk_value) const {
        std::vector<Value> partial((count + grain - 1) / grain, zero);
        for_chunks(count, grain, [&](std::size_t begin, std::size_t end) {
            partial[begin / grain] = chunk_value(begin, end);
        });
        Value total = zero;
        for (const Value& value : partial) total += value;
        return total;
    }

  private:
    struct Pool;
    std::unique_ptr<Pool> pool_;
};

}  // namespace splitcubes
