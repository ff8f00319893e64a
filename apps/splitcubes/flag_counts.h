// Counts the steps of a run in which each flag was set, and sums what the energy guard removed; advises on
// what was frequent or large.
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
    /// energy_removed: J, in the step; energy: J, kinetic and elastic after the step.
    void add(std::uint32_t flags, double energy_removed, double energy);
    /// Adds the steps of an earlier part of the run from its table (metrics.csv).
    void add_table(const std::string& metrics);

    std::size_t steps() const { return steps_; }
    /// Returns the number of steps with each flag, by its name.
    nlohmann::ordered_json json() const;
    /// Returns one line per flag that was set in more than a tenth of the steps and has a remedy; of
    /// steps that were to be explicit, in any. An energy excess has a line also where more than a hundredth
    /// of the largest energy was removed in all.
    std::vector<std::string> notes() const;

  private:
    std::string amount_removed() const;

    static constexpr std::size_t flag_count = 7;
    std::size_t steps_ = 0;
    std::array<std::size_t, flag_count> counts_{};
    double energy_removed_ = 0, largest_energy_ = 0;  // J
};

}  // namespace splitcubes::app
