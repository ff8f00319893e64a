// Settings that are kept from session to session.
#pragma once

#include "viewer.h"

#include <filesystem>

namespace splitcubes::view {

/// $XDG_CONFIG_HOME/splitcubes/viewer.json, else ~/.config/...; empty where there is neither.
std::filesystem::path settings_file();

/// Takes what a file holds; a file that is missing or damaged changes nothing.
void load_settings(const std::filesystem::path& file, Viewer& viewer);
/// Failures are of no consequence: the settings are then not kept.
void save_settings(const std::filesystem::path& file, const Viewer& viewer);

}  // namespace splitcubes::view
