// `bench contact`: what contact and tearing cost beside the rest of a step.
#pragma once

#include "report.h"

#include <string>

namespace splitcubes::app {

/// Prints the tables and returns their numbers (docs/reports.md lists the keys).
/// runs: of each world, medians are over the steps of all. threads: 0 takes all.
/// world: the only one to run; empty: all. Throws InputError where there is none of that name.
Json bench_contact(int runs, int threads, const std::string& world);

}  // namespace splitcubes::app
