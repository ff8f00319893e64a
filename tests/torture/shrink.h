// The smallest scene that still breaks a law.
#pragma once

#include "laws.h"
#include "trial.h"

#include <filesystem>
#include <functional>
#include <optional>

namespace splitcubes::torture {

/// Removes items that a failure does not need, by delta debugging (Zeller, Hildebrandt 2002): returns the
/// indices of a subset that still fails, of which no single item can be left out unless `fails` stops early.
std::vector<std::size_t> smallest_failing(std::size_t count,
                                          const std::function<bool(const std::vector<std::size_t>&)>& fails);

struct Shrink {
    std::filesystem::path program, folder;  // folder: of the scene
    std::optional<Law> law = {};            // none: the first that is broken
    int trials = 200;                       // at most
    ProcessLimits process = {};
};

/// Writes FOLDER/shrunk with the smallest scene, its meshes and its run, and says what is left. Throws
/// std::runtime_error where the scene breaks no law.
void shrink_scene(const Shrink& shrink);

}  // namespace splitcubes::torture
