#include "timeline.h"

#include "thinning.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace splitcubes::view {

namespace {

std::int64_t step_of(const State& state) {
    return state->step;
}

constexpr std::int64_t none_spared = std::numeric_limits<std::int64_t>::min();

}  // namespace

void Timeline::take_out(States::iterator at, std::vector<State>& dropped) {
    bytes_ -= (*at)->bytes();
    for (const BodyState& body : (*at)->bodies) {
        const auto users = users_.find(body.topology.get());
        if (users == users_.end() || --users->second > 0) continue;
        bytes_ -= body.topology->bytes();
        users_.erase(users);
    }
    dropped.push_back(std::move(*at));
    states_.erase(at);
}

void Timeline::put_in(States::iterator at, State state) {
    bytes_ += state->bytes();
    for (const BodyState& body : state->bodies)
        if (body.topology && users_[body.topology.get()]++ == 0) bytes_ += body.topology->bytes();
    states_.insert(at, std::move(state));
}

void Timeline::thin(std::int64_t spared, std::vector<State>& dropped) {
    while (states_.size() > 2 && bytes_ > budget_) {
        const auto at = states_.begin() + static_cast<std::ptrdiff_t>(least_missed(states_, step_of));
        if ((*at)->step == spared) return;
        take_out(at, dropped);
    }
}

void Timeline::add(State state) {
    std::vector<State> dropped;  // freed after the lock
    const std::lock_guard lock(mutex_);
    const bool is_new_scene = !states_.empty() && states_.back()->scene != state->scene;
    while (!states_.empty() && (is_new_scene || states_.back()->step >= state->step))
        take_out(states_.end() - 1, dropped);
    put_in(states_.end(), std::move(state));
    thin(none_spared, dropped);
}

void Timeline::insert(State state) {
    std::vector<State> dropped;
    const std::lock_guard lock(mutex_);
    if (states_.empty() || states_.back()->scene != state->scene) return;
    const auto at = std::lower_bound(states_.begin(), states_.end(), state->step,
                                     [](const State& one, std::int64_t step) { return one->step < step; });
    if (at == states_.end() || (*at)->step == state->step) return;
    const std::int64_t step = state->step;
    put_in(at, std::move(state));
    thin(step, dropped);
}

void Timeline::clear() {
    std::deque<State> dropped;
    const std::lock_guard lock(mutex_);
    dropped.swap(states_);
    users_.clear();
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

std::size_t Timeline::bytes() const {
    const std::lock_guard lock(mutex_);
    return bytes_;
}

State Timeline::at(std::int64_t step) const {
    const std::lock_guard lock(mutex_);
    const auto after = std::upper_bound(states_.begin(), states_.end(), step,
                                        [](std::int64_t s, const State& state) { return s < state->step; });
    return after == states_.begin() ? nullptr : *(after - 1);
}

}  // namespace splitcubes::view
