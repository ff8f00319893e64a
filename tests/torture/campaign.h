// Many seeds in a row.
#pragma once

#include "generator.h"
#include "trial.h"

#include <cstdint>
#include <filesystem>

namespace splitcubes::torture {

enum class Keep { all, failed, none };

struct Campaign {
    std::uint64_t first = 1, last = 100;
    std::filesystem::path program, work;
    int jobs = 1;
    Limits limits;
    ProcessLimits process;
    Keep keep = Keep::failed;  // scenes and runs that stay in the work folder
};

/// Runs the seeds that WORK/report.jsonl does not have yet, prints a line for each and a summary by law, and
/// adds to the report. Returns whether all scenes hold. Throws std::runtime_error where the report is of
/// other limits.
bool run_campaign(const Campaign& campaign);

}  // namespace splitcubes::torture
