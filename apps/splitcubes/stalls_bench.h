// `bench stalls`: the longest steps of bodies that fall apart.
#pragma once

#include "report.h"

#include <string>

namespace splitcubes::app {

/// Prints the tables and returns their numbers (docs/reports.md lists the keys). runs: per world; a step
/// takes the shortest of its times in all runs. threads: 0 takes all. world: the only one to run; empty: all.
/// Throws InputError for an unknown name.
Json bench_stalls(int runs, int threads, const std::string& world);

}  // namespace splitcubes::app
