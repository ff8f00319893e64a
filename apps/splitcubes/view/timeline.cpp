#include "timeline.h"

#include <algorithm>
#include <vector>

namespace splitcubes::view {

void Timeline::add(State state) {
    std::vector<State> dropped;  // freed after the lock
    const std::lock_guard lock(mutex_);
    if (!states_.empty() && states_.back()->scene != state->scene) {
        dropped.assign(states_.begin(), states_.end());
        states_.clear();
        bytes_ = 0;
    }
    while (!states_.empty() && states_.back()->step >= state->step) {
        bytes_ -= states_.back()->bytes();
        dropped.push_back(std::move(states_.back()));
        states_.pop_back();
    }
    bytes_ += state->bytes();
    states_.push_back(std::move(state));
    while (states_.size() > 1 && bytes_ > budget_) {
        bytes_ -= states_.front()->bytes();
        dropped.push_back(std::move(states_.front()));
        states_.pop_front();
    }
}

void Timeline::clear() {
    std::deque<State> dropped;
    const std::lock_guard lock(mutex_);
    dropped.swap(states_);
    bytes_ = 0;
}

std::optional<std::pair<std::int64_t, std::int64_t>> Timeline::range() const {
    const std::lock_guard lock(mutex_);
    if (states_.empty()) return std::nullopt;
    return std::pair{states_.front()->step, states_.back()->step};
}

std::vector<State> Timeline::states() const {
    const std::lock_guard lock(mutex_);
    return {states_.begin(), states_.end()};
}

State Timeline::at(std::int64_t step) const {
    const std::lock_guard lock(mutex_);
    const auto after = std::upper_bound(states_.begin(), states_.end(), step,
                                        [](std::int64_t s, const State& state) { return s < state->step; });
    return after == states_.begin() ? nullptr : *(after - 1);
}

}  // namespace splitcubes::view
