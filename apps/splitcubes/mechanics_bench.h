// `bench mechanics`: what a step of the elastic body costs, and what the machine allows.
#pragma once

#include "report.h"

#include <vector>

namespace splitcubes::app {

struct MechanicsBenchSettings {
    std::vector<int> threads;  // a table row each; empty: one and two
    int runs = 5;              // medians are taken over
};

/// Prints the tables and returns their numbers (docs/reports.md lists the keys).
Json bench_mechanics(const MechanicsBenchSettings& settings);

}  // namespace splitcubes::app
