// Random scenes from seeds.
#pragma once

#include "solids.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace splitcubes::torture {

/// Limits of what random scenes may contain.
struct Limits {
    std::set<std::string> without;              // of feature_names(): left out of every scene
    int max_blades = 300;                       // at most 300
    int max_phyxels = 1500;                     // of all bodies together, about; at least 400
    std::vector<std::filesystem::path> models;  // closed meshes that bodies may be
};

/// The features that can be left out.
const std::vector<std::string>& feature_names();

struct GeneratedScene {
    Json scene;
    std::map<std::string, std::string> files;  // by name: meshes beside the scene
};

/// The same seed, limits and models give the same scene.
GeneratedScene make_scene(std::uint64_t seed, const Limits& limits);

/// Writes scene.json and its meshes into a folder, which is made.
void write_scene(const GeneratedScene& generated, const std::filesystem::path& folder);

}  // namespace splitcubes::torture
