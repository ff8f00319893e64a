// What each criterion of visibility takes on the same cut.
#pragma once

#include <string>
#include <vector>

namespace splitcubes::app {

struct CriterionTimes {
    std::string name;
    std::vector<int> step;             // that cut
    std::vector<double> milliseconds;  // of each: the stage update_visibility, median of the runs
    double pairs = 0;                  // a step whose factors were asked for, mean
};

/// The blade of `bench paper` through its block under each criterion in turn.
/// threads: 0 takes all.
std::vector<CriterionTimes> time_criteria(int runs, int threads);

/// Milliseconds over steps, logarithmic, as SVG.
std::string criteria_plot(const std::vector<CriterionTimes>& times);

}  // namespace splitcubes::app
