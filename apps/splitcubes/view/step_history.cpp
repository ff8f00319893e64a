#include "step_history.h"

#include <algorithm>
#include <cmath>

namespace splitcubes::view {

Spread spread_of(std::vector<double> values) {
    if (values.empty()) return {};
    std::sort(values.begin(), values.end());
    const auto at = [&](double share) {
        return values[static_cast<std::size_t>(std::llround(share * static_cast<double>(values.size() - 1)))];
    };
    return {at(0.5), at(0.99), values.back()};
}

const std::array<std::string_view, stage_count>& stage_labels() {
    static constexpr std::array<std::string_view, stage_count> labels = {
        "move tools", "cut edges",  "tear",     "retessellate", "label pieces", "visibility",
        "resample",   "neighbours", "contacts", "integrate",    "node frames",  "surface"};
    return labels;
}

void StepHistory::add(const PublishedState& state) {
    if (state.scene != scene_ || state.step < last_) steps_.clear();
    const bool is_new = state.step != last_ || state.scene != scene_;
    scene_ = state.scene;
    last_ = state.step;
    if (!is_new || state.step == 0) return;
    steps_.push_back(state.statistics);
    if (steps_.size() > history_length) steps_.pop_front();
}

Spread StepHistory::total() const {
    std::vector<double> values;
    for (const StepStatistics& step : steps_) values.push_back(step.step_ms);
    return spread_of(std::move(values));
}

Spread StepHistory::stage(std::size_t index) const {
    std::vector<double> values;
    for (const StepStatistics& step : steps_) values.push_back(step.stage_ms[index]);
    return spread_of(std::move(values));
}

void Latencies::sent(std::uint64_t command, double time) {
    open_.push_back({command, time});
}

void Latencies::shown(std::uint64_t commands, double time) {
    for (; !open_.empty() && open_.front().command <= commands; open_.pop_front())
        values_.push_back(1e3 * (time - open_.front().time));
    while (values_.size() > history_length) values_.pop_front();
}

Spread Latencies::spread() const {
    return spread_of({values_.begin(), values_.end()});
}

}  // namespace splitcubes::view
