// The states of a session, to look at again.
#pragma once

#include "published_state.h"

#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

namespace splitcubes::view {

/// Keeps states from the first one to the last one within a budget of memory: the older they are, the more
/// steps lie between two of them. For several threads: a lock is held while pointers move, never while a
/// state is made or freed.
class Timeline {
  public:
    explicit Timeline(std::size_t budget_bytes) : budget_(budget_bytes) {}
    /// A state whose step is not after the last one's replaces what is from there on.
    void add(State state);
    /// Adds a state between others of its scene. It stays until the next one is inserted.
    void insert(State state);
    void clear();
    /// First and last step.
    std::optional<std::pair<std::int64_t, std::int64_t>> range() const;
    /// The last state that is not after a step; null: there is none.
    State at(std::int64_t step) const;
    /// All of them, ascending.
    std::vector<State> states() const;
    /// The memory that they take.
    std::size_t bytes() const;

  private:
    using States = std::deque<State>;
    void take_out(States::iterator at, std::vector<State>& dropped);
    void put_in(States::iterator at, State state);

    std::size_t budget_;
    mutable std::mutex mutex_;
    States states_;
    State inserted_;  // beside them; thinning would take it out again at once
    std::size_t bytes_ = 0;
    std::unordered_map<const SurfaceTopology*, std::size_t> users_;  // states that share one
};

}  // namespace splitcubes::view
