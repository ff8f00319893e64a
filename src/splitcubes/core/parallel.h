// Parallel loops whose results do not depend on the number of threads: work is
// cut into chunks of a fixed size, a chunk is run by one thread in index order,
// and reductions add the chunks' results in chunk order.
#pragma once

#include <splitcubes/core/monitor.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace splitcubes {

/// A pool of threads to run loops on. Passed to what needs it; there is no global one.
class Parallel {
  public:
    /// thread_count 0 takes what the machine has.
    explicit Parallel(int thread_count = 0);
    ~Parallel();
    Parallel(Parallel&&) noexcept;
    Parallel& operator=(Parallel&&) noexcept;

    int thread_count() const;

    /// From now on loops tell the monitor how far they are and throw Cancelled at the next chunk where it
    /// says so; nullptr: none does, as at the start. The monitor has to outlive that.
    void watch(Monitor* monitor);
    /// Tells the monitor, if there is one, what comes next; throws Cancelled.
    void begin(const std::string& stage) const;
    /// For work of some time outside loops: throws Cancelled.
    void check() const;

    /// Calls body(begin, end) for consecutive chunks of at most `grain` indices
    /// of [0, count). Chunks run in any order and at the same time.
    void for_chunks(std::size_t count, std::size_t grain,
                    const std::function<void(std::size_t, std::size_t)>& body) const;

    /// Calls body(i) for each i of [0, count), `grain` consecutive ones a chunk.
    template <class Body>
    void for_each(std::size_t count, std::size_t grain, const Body& body) const {
        for_chunks(count, grain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) body(i);
        });
    }

    /// Sum of chunk_value(begin, end) over the chunks, added in chunk order: the
    /// same to the last bit for any number of threads.
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
