// Counts the steps of a run in which each flag was set; advises on those that were set often.
#pragma once

#include <splitcubes/body/step_report.h>
#include <nlohmann/json_fwd.hpp>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace splitcubes::app {

class FlagCounts {
  public:
    void add(std::uint32_t flags);
    /// Adds the steps of an earlier part of the run from its table (metrics.csv).
    void add_table(const std::string& metrics);

    std::size_t steps() const { return steps_; }
    /// Returns the number of steps with each flag, by its name.
    nlohmann::ordered_json json() const;
    /// Returns one line per flag that was set in more than a tenth of the steps and has a remedy.
    std::vector<std::string> notes() const;

  private:
    static constexpr std::size_t flag_count = 6;
    std::size_t steps_ = 0;
    std::array<std::size_t, flag_count> counts_{};
};

}  // namespace splitcubes::app
