#include "timeline.h"

#include "thinning.h"

#include <algorithm>
#include <vector>

namespace splitcubes::view {

namespace {

std::int64_t step_of(const State& state) {
    return state->step;
}

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

void Timeline::add(State state) {
    std::vector<State> dropped;  // freed after the lock
    const std::lock_guard lock(mutex_);
    const bool is_new_scene = !states_.empty() && states_.back()->scene != state->scene;
    if (inserted_ && (is_new_scene || inserted_->step >= state->step))
        dropped.push_back(std::move(inserted_));
    while (!states_.empty() && (is_new_scene || states_.back()->step >= state->step))
        take_out(states_.end() - 1, dropped);
    put_in(states_.end(), std::move(state));
    while (states_.size() > 2 && bytes_ > budget_)
        take_out(states_.begin() + static_cast<std::ptrdiff_t>(least_missed(states_, step_of)), dropped);
}

void Timeline::insert(State state) {
    const std::lock_guard lock(mutex_);
    const bool is_between = !states_.empty() && states_.back()->scene == state->scene &&
                            states_.front()->step < state->step && state->step < states_.back()->step;
    if (is_between) inserted_.swap(state);
}

void Timeline::clear() {
    std::deque<State> dropped;
    State inserted;
    const std::lock_guard lock(mutex_);
    dropped.swap(states_);
    inserted.swap(inserted_);
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
    if (after == states_.begin()) return nullptr;
    const State& before = *(after - 1);
    return inserted_ && inserted_->step <= step && inserted_->step > before->step ? inserted_ : before;
}

}  // namespace splitcubes::view
