// Cost of each visibility criterion on the same cut.
#pragma once

#include <string>
#include <vector>

namespace splitcubes::app {

struct CriterionTimes {
    std::string name;
    std::vector<int> step;             // indices of the steps that cut
    std::vector<double> milliseconds;  // of each step: the stage update_visibility, median over the runs
    double pairs = 0;                  // pairs a step whose factors were computed, mean
};

/// Runs the world of `bench paper` under each criterion. threads: 0 takes all.
std::vector<CriterionTimes> time_criteria(int runs, int threads);

/// Plots milliseconds (logarithmic) over steps as SVG.
std::string criteria_plot(const std::vector<CriterionTimes>& times);

}  // namespace splitcubes::app
