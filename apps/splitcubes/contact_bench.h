// `bench contact`: the cost of contact and tearing within a step.
#pragma once

#include "report.h"

#include <splitcubes/world/world.h>

#include <memory>
#include <string>

namespace splitcubes::app {

/// Prints the tables and returns their numbers (docs/reports.md lists the keys). runs: per world; medians are
/// over the steps of all runs. threads: 0 takes all. world: the only one to run; empty: all. Throws
/// InputError for an unknown name.
Json bench_contact(int runs, int threads, const std::string& world);

/// Builds the world "large, tearing": 29,791 phyxels that tear under their own weight.
std::unique_ptr<body::World> make_large_tearing_world(const std::shared_ptr<const Parallel>& parallel);

}  // namespace splitcubes::app
