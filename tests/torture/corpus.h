// Scenes that once failed, with their table.
#pragma once

#include "trial.h"

#include <filesystem>
#include <string>
#include <vector>

namespace splitcubes::torture {

struct CorpusRow {
    std::string scene, seed, law, status;  // status: `holds` or `fails`
};

/// Reads the table of a README.md: | scene | seed | law | what happens | known since | status |. Throws
/// std::runtime_error for another status, an unknown law, a scene without a row and a row without a scene.
std::vector<CorpusRow> read_corpus(const std::filesystem::path& folder);

/// Runs the scenes of that status in `work` and prints a line for each. Returns whether each does what its
/// status says: one that holds obeys all laws, one that fails breaks its law.
bool run_corpus(const std::filesystem::path& folder, const std::string& status,
                const std::filesystem::path& program, const std::filesystem::path& work,
                const ProcessLimits& limits);

}  // namespace splitcubes::torture
