#include <splitcubes/core/error.h>
#include <splitcubes/core/sha256.h>
#include <splitcubes/scene/inputs.h>
#include <splitcubes/scene/tuning.h>

#include <algorithm>
#include <map>
#include <system_error>

namespace splitcubes::scene {

namespace fs = std::filesystem;

namespace {

void add_mesh(const std::string& owner, Shape& shape, std::vector<Input>& out) {
    if (auto* mesh = std::get_if<MeshShape>(&shape))
        out.push_back({"the mesh of " + owner, &mesh->file, &mesh->sha256});
}

/// Returns files with the extension of `name`; those with the same name come first.
std::vector<fs::path> candidates(const fs::path& folder, const fs::path& name) {
    std::vector<fs::path> same, others;
    std::error_code error;
    constexpr auto options = fs::directory_options::skip_permission_denied;
    for (auto at = fs::recursive_directory_iterator(folder, options, error);
         at != fs::recursive_directory_iterator() &&
         same.size() + others.size() < tuning::input::max_candidates;
         at.increment(error)) {
        if (!at->is_regular_file(error)) continue;
        if (at->path().filename() == name.filename())
            same.push_back(at->path());
        else if (at->path().extension() == name.extension())
            others.push_back(at->path());
    }
    std::sort(same.begin(), same.end());
    std::sort(others.begin(), others.end());
    same.insert(same.end(), others.begin(), others.end());
    return same;
}

class Contents {
  public:
    /// Returns the content's SHA-256; empty if there is no such file.
    const std::string& of(const fs::path& file) {
        std::error_code error;
        const auto [found, is_new] = known_.try_emplace(file);
        if (is_new && fs::is_regular_file(file, error)) found->second = sha256_of_file(file);
        return found->second;
    }
    /// Finds a file in the folders with the input's content; empty if there is none.
    fs::path find(const Input& input, std::span<const fs::path> folders) {
        for (const fs::path& folder : folders)
            for (const fs::path& file : candidates(folder, *input.file))
                if (of(file) == *input.sha256) return fs::absolute(file).lexically_normal();
        return {};
    }

  private:
    std::map<fs::path, std::string> known_;
};

[[noreturn]] void refuse(const Input& input, const std::string& content, std::span<const fs::path> folders) {
    std::string problem = content.empty() ? "there is no such file" : "has changed";
    problem += "; it is " + input.what;
    if (!input.sha256->empty()) problem += " (sha256 " + *input.sha256 + ")";
    if (!folders.empty()) {
        problem += ", and no file with the same content is in";
        for (const fs::path& folder : folders) problem += ' ' + folder.string();
    }
    throw InputError(input.file->string(), problem,
                     content.empty()
                         ? "put it there, or name a folder that has it with --inputs"
                         : "restore the old one, name a folder that has it with --inputs, or take the "
                           "sha256 out of the scene");
}

}  // namespace

std::vector<Input> inputs_of(SceneDescription& scene) {
    std::vector<Input> out;
    for (BodyDescription& body : scene.bodies) {
        const std::string owner = "body '" + body.name + "'";
        add_mesh(owner, body.shape, out);
        if (!body.material.tearing) continue;
        for (StrengthLayer& layer : body.material.tearing->strength_map)
            if (auto* paint = std::get_if<StrengthPaint>(&layer); paint && !paint->picture.empty())
                out.push_back(
                    {"the picture of the strength of " + owner, &paint->picture, &paint->picture_sha256});
    }
    for (ColliderDescription& collider : scene.colliders)
        if (collider.shape) add_mesh("collider '" + collider.name + "'", *collider.shape, out);
    for (ToolDescription& tool : scene.tools)
        if (auto* mesh = tool.instrument ? std::get_if<MeshInstrument>(&*tool.instrument) : nullptr)
            out.push_back({"the mesh of tool '" + tool.name + "'", &mesh->mesh.file, &mesh->mesh.sha256});
    return out;
}

void find_inputs(SceneDescription& scene, std::span<const fs::path> folders) {
    std::error_code error;
    for (const fs::path& folder : folders)
        if (!fs::is_directory(folder, error))
            throw InputError(folder.string(), "there is no such folder",
                             "give one that has the files of the scene");
    Contents contents;
    for (const Input& input : inputs_of(scene)) {
        const std::string& content = contents.of(*input.file);
        if (input.sha256->empty() && !content.empty()) *input.sha256 = content;
        if (!content.empty() && content == *input.sha256) continue;
        const fs::path found = input.sha256->empty() ? fs::path() : contents.find(input, folders);
        if (found.empty()) refuse(input, content, folders);
        *input.file = found;
    }
}

SceneDescription without_file_names(SceneDescription scene) {
    for (const Input& input : inputs_of(scene)) input.file->clear();
    return scene;
}

}  // namespace splitcubes::scene
