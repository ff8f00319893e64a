// The states that were published last, to look at again.
#pragma once

#include "published_state.h"

#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace splitcubes::view {

/// Keeps states within a budget of memory; the oldest go first. For several threads: a lock is held while a
/// pointer moves, never while a state is made or freed.
class Timeline {
  public:
    explicit Timeline(std::size_t budget_bytes) : budget_(budget_bytes) {}
    /// A state whose step is not after the last one's replaces what is from there on.
    void add(State state);
    void clear();
    /// First and last step.
    std::optional<std::pair<std::int64_t, std::int64_t>> range() const;
    /// The last state that is not after a step; null: there is none.
    State at(std::int64_t step) const;
    /// All of them, ascending.
    std::vector<State> states() const;

  private:
    std::size_t budget_;
    mutable std::mutex mutex_;
    std::deque<State> states_;
    std::size_t bytes_ = 0;
};

}  // namespace splitcubes::view
