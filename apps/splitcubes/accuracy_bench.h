// `bench surface`: tables of the surface's accuracy.
#pragma once

#include "report.h"

#include <string>
#include <vector>

namespace splitcubes::app {

/// Prints the tables, with a row per mesh file, and returns their numbers. Throws InputError if a file cannot
/// be read.
Json bench_accuracy(const std::vector<std::string>& files, const Parallel& parallel);

}  // namespace splitcubes::app
