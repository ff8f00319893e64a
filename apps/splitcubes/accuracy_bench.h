// `bench surface`: the tables of accuracy.
#pragma once

#include "report.h"

#include <string>
#include <vector>

namespace splitcubes::app {

/// Prints the tables, with a row for each of the mesh files, and returns their numbers.
/// Throws InputError where a file cannot be read.
Json bench_accuracy(const std::vector<std::string>& files, const Parallel& parallel);

}  // namespace splitcubes::app
