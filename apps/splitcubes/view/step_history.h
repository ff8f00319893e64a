// Measures of the last steps, for graphs.
#pragma once

#include "published_state.h"

#include <array>
#include <cstddef>
#include <deque>
#include <string_view>
#include <vector>

namespace splitcubes::view {

inline constexpr std::size_t history_length = 300;

/// Median, 99th percentile and worst of some values.
struct Spread {
    double median = 0, high = 0, worst = 0;
};
Spread spread_of(std::vector<double> values);

/// The stages in their order; see docs/architecture.md.
const std::array<std::string_view, stage_count>& stage_labels();

/// Keeps the statistics of the last steps that were shown.
class StepHistory {
  public:
    /// A state that was added before is not added again; an earlier one begins anew.
    void add(const PublishedState& state);
    const std::deque<StepStatistics>& steps() const { return steps_; }
    Spread total() const;
    Spread stage(std::size_t index) const;

  private:
    std::deque<StepStatistics> steps_;
    std::int64_t last_ = -1;
    std::uint64_t scene_ = 0;
};

/// Latencies of the last inputs, from the event to the first picture that contains it.
class Latencies {
  public:
    /// An event at a time (s) became a command of a number.
    void sent(std::uint64_t command, double time);
    /// A picture of a state that contains commands up to a number was shown at a time (s).
    void shown(std::uint64_t commands, double time);
    Spread spread() const;  // ms
    std::size_t count() const { return values_.size(); }

  private:
    struct Sent {
        std::uint64_t command;
        double time;
    };
    std::deque<Sent> open_;
    std::deque<double> values_;  // ms
};

}  // namespace splitcubes::view
