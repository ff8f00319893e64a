#include "input_copies.h"

#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/sha256.h>
#include <splitcubes/scene/inputs.h>

#include <algorithm>
#include <fstream>
#include <system_error>

namespace splitcubes::app {

namespace fs = std::filesystem;

namespace {

/// Returns a name that is valid in a scene and in a line of the list of files.
std::string safe_name(const fs::path& file) {
    const std::string name = file.filename().string();
    const bool plain = std::all_of(name.begin(), name.end(),
                                   [](char c) { return (c & 0x80) != 0 || (c >= ' ' && c != 0x7f); });
    return plain && name.size() <= 120 ? name : "input" + file.extension().string().substr(0, 10);
}

/// Returns the path as the mesh refers to it if it is below the mesh's folder, otherwise the file name beside
/// the mesh: readers search there.
std::string name_beside(const fs::path& mesh, const fs::path& file) {
    const fs::path relative = file.lexically_normal().lexically_relative(mesh.parent_path());
    const bool below = !relative.empty() && *relative.begin() != ".." && *relative.begin() != ".";
    return below ? relative.generic_string() : safe_name(file);
}

void copy(const fs::path& from, const fs::path& to, const std::string& sha256) {
    std::ifstream in(from, std::ios::binary);
    AtomicFile out(to);
    Sha256 hash;
    std::vector<char> part(std::size_t{1} << 20);
    while (in) {
        in.read(part.data(), static_cast<std::streamsize>(part.size()));
        const std::string_view bytes(part.data(), static_cast<std::size_t>(in.gcount()));
        hash.add(bytes);
        out.write(bytes);
    }
    if (!in.eof() || hash.text() != sha256)
        throw JobError(from.string() + ": was changed while it was copied; run again");
    out.commit();
}

bool is_elsewhere(const std::string& texture) {
    return texture.empty() || texture.find("://") != texture.npos;
}

}  // namespace

InputCopies::InputCopies(const scene::SceneDescription& scene, const scene::BuildReport& built)
    : scene_(scene) {
    for (const scene::Input& input : scene::inputs_of(scene_)) {
        if (groups_.contains(*input.file)) continue;
        const auto others = built.files.find(*input.file);
        add(*input.file, *input.sha256,
            others == built.files.end() ? std::vector<fs::path>() : others->second);
    }
}

void InputCopies::add(const fs::path& file, const std::string& sha256, const std::vector<fs::path>& others) {
    Group group;
    group.name = safe_name(file);
    std::vector<Copy> copies = {{file, group.name, sha256}};
    for (const fs::path& other : others) {
        const std::string name = name_beside(file, other);
        const bool taken =
            std::any_of(copies.begin(), copies.end(), [&](const Copy& c) { return c.name == name; });
        if (!taken) copies.push_back({other, name, sha256_of_file(other)});
        if (!taken) group.others.emplace(other.lexically_normal(), name);
    }
    std::sort(copies.begin() + 1, copies.end(), [](const Copy& a, const Copy& b) { return a.name < b.name; });
    Sha256 all;
    for (const Copy& one : copies) all.add(one.name + '\n' + one.sha256 + '\n');
    group.content = all.text().substr(0, 16);
    for (Copy& one : copies) {
        one.name = group.content + '/' + one.name;
        if (names_.insert(one.name).second) copies_.push_back(std::move(one));
    }
    groups_.emplace(file, std::move(group));
}

bool InputCopies::has_source(const fs::path& file) const {
    std::error_code error;
    return std::any_of(copies_.begin(), copies_.end(),
                       [&](const Copy& one) { return fs::equivalent(one.from, file, error); });
}

void InputCopies::write(const std::function<fs::path(const std::string&)>& target) const {
    std::error_code error;
    for (const Copy& one : copies_) {
        const fs::path to = target(one.name);
        if (!fs::exists(to, error))
            copy(one.from, to, one.sha256);
        else if (sha256_of_file(to) != one.sha256)
            throw JobError(to.string() + ": is not a copy of " + one.from.string() + "; move it away");
    }
}

scene::SceneDescription InputCopies::scene_in(const fs::path& folder) const {
    scene::SceneDescription out = scene_;
    for (const scene::Input& input : scene::inputs_of(out)) {
        const Group& group = groups_.at(*input.file);
        *input.file = fs::absolute(folder / group.content / group.name).lexically_normal();
    }
    return out;
}

void InputCopies::move_textures(const fs::path& folder, std::vector<io::Model>& models) const {
    for (std::size_t k = 0; k < std::min(models.size(), scene_.bodies.size()); ++k) {
        const auto* mesh = std::get_if<scene::MeshShape>(&scene_.bodies[k].shape);
        if (mesh == nullptr) continue;
        const Group& group = groups_.at(mesh->file);
        for (geometry::Material& material : models[k].attributes.materials) {
            if (material.image || is_elsewhere(material.texture)) continue;
            const fs::path texture = fs::path(material.texture).lexically_normal();
            const auto known = group.others.find(texture);
            const std::string name =
                known == group.others.end() ? name_beside(mesh->file, texture) : known->second;
            material.texture = (folder / group.content / name).generic_string();
        }
    }
}

}  // namespace splitcubes::app
