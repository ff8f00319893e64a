// Checks a run by the files that it wrote.
#pragma once

#include "laws.h"

#include <filesystem>

namespace splitcubes::torture {

/// Reads the scene's folder (scene.json) and the run's (metrics.csv, surface/*.ply). Files that are missing
/// or damaged break the law `complete`; of a run that was stopped (`whole` is false) only what there is
/// counts. The laws `ended` and `time` are left to whoever ran the program.
Verdict check_run(const std::filesystem::path& scene_folder, const std::filesystem::path& run_folder,
                  bool whole = true);

}  // namespace splitcubes::torture
