// Times occlusion disks by backend, and ray tracing of the same samples.
#pragma once

#include "report.h"

namespace splitcubes::app {

/// Prints a table and one line of JSON, which it returns. runs: for the medians.
Json bench_occlusion(int runs);

}  // namespace splitcubes::app
