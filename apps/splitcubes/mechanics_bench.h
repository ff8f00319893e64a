// `bench mechanics`: the cost of a step of the elastic body, and its lower bound on the machine.
#pragma once

#include "report.h"

#include <vector>

namespace splitcubes::app {

struct MechanicsBenchSettings {
    std::vector<int> threads;  // one table row each; empty: one and two
    int runs = 5;              // for the medians
};

/// Prints the tables and returns their numbers (docs/reports.md lists the keys).
Json bench_mechanics(const MechanicsBenchSettings& settings);

}  // namespace splitcubes::app
