#include "kept_settings.h"

#include <splitcubes/core/atomic_file.h>

#include <cstdlib>
#include <exception>
#include <fstream>
#include <string>

#include <nlohmann/json.hpp>

namespace splitcubes::view {

std::filesystem::path settings_file() {
    const char* config = std::getenv("XDG_CONFIG_HOME");
    if (config != nullptr && *config != '\0')
        return std::filesystem::path(config) / "splitcubes" / "viewer.json";
    const char* home = std::getenv("HOME");
    if (home == nullptr || *home == '\0') return {};
    return std::filesystem::path(home) / ".config" / "splitcubes" / "viewer.json";
}

void load_settings(const std::filesystem::path& file, Viewer& viewer) {
    std::ifstream in(file);
    const auto json = nlohmann::json::parse(in, nullptr, false);
    if (!json.is_object()) return;
    for (const std::string& name : Viewer::kept_settings())
        if (json.contains(name) && json[name].is_number())
            viewer.take({.kind = InputKind::set, .name = name, .value = json[name].get<double>()});
}

void save_settings(const std::filesystem::path& file, const Viewer& viewer) {
    if (file.empty()) return;
    nlohmann::ordered_json json;
    for (const std::string& name : Viewer::kept_settings()) json[name] = viewer.setting(name);
    try {
        std::filesystem::create_directories(file.parent_path());
        write_file(file, json.dump(2) + '\n');
    } catch (const std::exception&) {
        return;
    }
}

}  // namespace splitcubes::view
