#include "gallery.h"

#include "engine.h"

#include <splitcubes/io/mesh_format.h>
#include <splitcubes/scene/parse.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <map>

namespace splitcubes::view {

namespace {

namespace fs = std::filesystem;

constexpr double shown_share = 0.62;  // of a scene's time
constexpr int max_steps = 240;

// Meshes of the folder that are bodies, not tools; those that a beginner should see first.
constexpr std::array<std::pair<std::string_view, std::string_view>, 2> bodies = {
    {{"liver.obj", "Liver: cut it by hand"}, {"pear.obj", "Pear: cut it by hand"}}};

void add_scenes(const fs::path& folder, std::vector<GalleryItem>& out) {
    std::error_code error;
    std::vector<GalleryItem> found;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        if (entry.path().extension() != ".json" || entry.path().filename() == "schema.json") continue;
        try {
            const scene::SceneDescription scene = scene::parse_scene_file(entry.path());
            if (std::none_of(scene.bodies.begin(), scene.bodies.end(),
                             [](const scene::BodyDescription& b) { return b.deformation.has_value(); }))
                found.push_back({entry.path(), scene.name});
        } catch (const std::exception&) {
            continue;  // it would not open, either
        }
    }
    std::sort(found.begin(), found.end(),
              [](const GalleryItem& a, const GalleryItem& b) { return a.file < b.file; });
    out.insert(out.end(), found.begin(), found.end());
}

// Fowler, Noll and Vo; a name needs no more.
std::uint64_t hash_of(const std::string& text) {
    std::uint64_t out = 14695981039346656037U;
    for (const char c : text) out = (out ^ static_cast<unsigned char>(c)) * 1099511628211U;
    return out;
}

// Small pictures do not show the finest cells.
SceneSource coarser(SceneSource source) {
    constexpr double factor = 1.3;
    for (BodySource& body : source.bodies) {
        body.settings.cell_size *= factor;
        body.settings.phyxel_spacing *= factor;
        body.settings.phyxel_count = std::max(60, body.settings.phyxel_count / 2);
    }
    return source;
}

fs::path cache_folder() {
    if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0') return cache;
    const char* home = std::getenv("HOME");
    return home != nullptr && *home != '\0' ? fs::path(home) / ".cache" : fs::path();
}

}  // namespace

fs::path scenes_folder() {
    std::error_code error;
    if (const char* named = std::getenv("SPLITCUBES_SCENES"); named != nullptr && *named != '\0')
        return fs::is_directory(named, error) ? fs::path(named) : fs::path();
    std::vector<fs::path> places;
    const fs::path program = fs::read_symlink("/proc/self/exe", error);
    if (!program.empty()) {
        const fs::path bin = program.parent_path();
        places.push_back(bin.parent_path() / "share" / "splitcubes" / "scenes");
        places.push_back(bin.parent_path().parent_path().parent_path() / "scenes");  // build/release/bin
    }
    places.push_back(fs::current_path(error) / "scenes");
    for (const fs::path& place : places)
        if (fs::is_regular_file(place / "schema.json", error)) return place;
    return {};
}

std::vector<GalleryItem> gallery_items(const fs::path& folder) {
    std::vector<GalleryItem> out;
    if (folder.empty()) return out;
    std::error_code error;
    for (const auto& [file, title] : bodies)
        if (fs::is_regular_file(folder / "meshes" / file, error))
            out.push_back({folder / "meshes" / file, std::string(title)});
    add_scenes(folder / "gallery", out);
    add_scenes(folder, out);
    return out;
}

fs::path thumbnail_file(const fs::path& item) {
    constexpr std::string_view version = "2";  // of what thumbnails show
    const fs::path cache = cache_folder();
    std::error_code error;
    const auto size = fs::file_size(item, error);
    const auto changed = fs::last_write_time(item, error).time_since_epoch().count();
    if (cache.empty() || error) return {};
    const std::uint64_t hash = hash_of(fs::absolute(item, error).string() + '\n' + std::to_string(size) +
                                       '\n' + std::to_string(changed) + '\n' + std::string(version));
    std::array<char, 17> text{};
    const auto end = std::to_chars(text.data(), text.data() + 16, hash, 16).ptr;
    return cache / "splitcubes" / "thumbnails" / (std::string(text.data(), end) + ".png");
}

State thumbnail_state(const fs::path& item, const std::function<bool()>& stops) {
    try {
        Engine engine(coarser(open_source(item)), {.threads = 1, .undo_bytes = 0, .timeline_bytes = 0});
        int steps = 0;
        if (item.extension() == ".json")
            steps = std::min(max_steps, static_cast<int>(shown_share * engine.source().description.frames));
        for (int k = 0; k < steps; ++k) {
            if (stops()) return nullptr;
            engine.step();
        }
        std::shared_ptr<PublishedState> out = engine.publish();
        out->scene = 1;
        return out;
    } catch (const std::exception&) {
        return nullptr;
    }
}

}  // namespace splitcubes::view
