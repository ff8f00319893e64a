// Occlusion disks timed by backend, and the same samples traced as rays.
#pragma once

#include "report.h"

namespace splitcubes::app {

/// Prints a table and one line of JSON, which it returns. runs: to take medians over.
Json bench_occlusion(int runs);

}  // namespace splitcubes::app
