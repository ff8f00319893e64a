// The scenes and meshes that come along, to open without naming a file.
#pragma once

#include "published_state.h"

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace splitcubes::view {

struct GalleryItem {
    std::filesystem::path file;
    std::string title;
};

/// Returns the folder of the scenes that come along: that of the environment variable SPLITCUBES_SCENES, of
/// the installation or the source that the program lies in, or `scenes` here. Empty: there is none.
std::filesystem::path scenes_folder();

/// Returns meshes to cut by hand first, then the gallery, then the other scenes of a folder, without those
/// that the viewer does not simulate.
std::vector<GalleryItem> gallery_items(const std::filesystem::path& folder);

/// Returns the file that keeps an item's thumbnail, below XDG_CACHE_HOME or ~/.cache; another one after a
/// change of the item's file or of the program's version. Empty: there is no place for it.
std::filesystem::path thumbnail_file(const std::filesystem::path& item);

/// Returns what a thumbnail shows: a mesh as it lies, a scene after the larger part of its time. Null where
/// it cannot be opened, or after `stops` says so between two steps.
State thumbnail_state(const std::filesystem::path& item, const std::function<bool()>& stops);

}  // namespace splitcubes::view
