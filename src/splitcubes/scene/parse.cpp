#include <splitcubes/core/error.h>
#include <splitcubes/io/mesh_format.h>
#include <splitcubes/scene/json_location.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/read_scene.h>
#include <splitcubes/scene/resolve.h>

#include <array>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

namespace splitcubes::scene {

namespace {

using Json = nlohmann::ordered_json;

// Parses text that has passed check_json.
Json parse_checked(std::string_view text, const std::string& where) {
    try {
        return Json::parse(text, nullptr, true, true);
    } catch (const Json::exception&) {
        throw InputError(where, "cannot be read as JSON", "check its syntax");
    }
}

bool is_utf8(std::string_view text) {
    try {
        return !Json(std::string(text)).dump().empty();
    } catch (const Json::exception&) {
        return false;
    }
}

// Returns whether the text starts like JSON, so that syntax errors in it are reported.
bool looks_like_json(std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    return first == std::string_view::npos ||
           std::string_view("[{\"").find(text[first]) != std::string_view::npos;
}

// Text that is not JSON becomes a string; the reader reports it if a number is expected.
Json parse_override_value(std::string_view text, const std::string& option) {
    try {
        check_json(text, option, ParseLimits::nesting_depth, false);
    } catch (const InputError&) {
        if (looks_like_json(text)) throw;
        if (!is_utf8(text)) throw InputError(option, "is not UTF-8", "write it as UTF-8");
        return std::string(text);
    }
    return parse_checked(text, option);
}

// Throws if a step of the path cannot exist. Objects may be missing on the way.
void check_path(const Override& change, const Json& scene) {
    const Json* at = &scene;
    for (const PathStep& step : change.path) {
        const bool missing = at == nullptr || at->is_null();
        if (step.index >= 0) {
            const std::size_t there = !missing && at->is_array() ? at->size() : 0;
            if (static_cast<std::size_t>(step.index) >= there)
                throw InputError(change.option,
                                 "there is no element [" + std::to_string(step.index) + "], the scene has " +
                                     (!missing && at->is_array() ? std::to_string(there) : "none"),
                                 "elements are counted from 0");
            at = &(*at)[static_cast<std::size_t>(step.index)];
        } else if (missing) {
            at = nullptr;
        } else if (!at->is_object()) {
            throw InputError(change.option, "the scene has no object that '" + step.key + "' could be in",
                             "elements of an array are named like bodies[0]");
        } else {
            const auto found = at->find(step.key);
            at = found == at->end() ? nullptr : &*found;
        }
    }
}

// Returns the value inside `parent` that a step leads to; creates missing objects.
Json& step_into(Json& parent, const PathStep& step) {
    if (step.index >= 0) return parent[static_cast<std::size_t>(step.index)];
    if (parent.is_null()) parent = Json::object();
    return parent[step.key];
}

// Pairs of keys that exclude each other (Object::not_both): an override of one removes the other.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> alternatives = {
    {{"frames", "duration"},
     {"cells", "cell_size"},
     {"phyxel_count", "phyxel_spacing"},
     {"shape", "half_space"}}};

void take_out_alternative(const std::string& key, Json& object) {
    for (const auto& [one, other] : alternatives) {
        if (key == one) object.erase(std::string(other));
        if (key == other) object.erase(std::string(one));
    }
}

void apply(const Override& change, Json value, Json& scene) {
    check_path(change, scene);
    Json* parent = &scene;
    for (std::size_t i = 0; i + 1 < change.path.size(); ++i) parent = &step_into(*parent, change.path[i]);
    const PathStep& last = change.path.back();
    if (value.is_null() && last.index < 0 && parent->is_object()) {
        parent->erase(last.key);
    } else {
        step_into(*parent, last) = std::move(value);
        if (last.index < 0) take_out_alternative(last.key, *parent);
    }
}

void apply_override(const std::string& text, Json& scene, Source& source) {
    Override change;
    change.option = "--set " + printable(text, 200);
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos)
        throw InputError(change.option, "has no '='", "write it like bodies[0].material.density=900");
    change.path = parse_path(std::string_view(text).substr(0, equals), change.option);
    apply(change, parse_override_value(std::string_view(text).substr(equals + 1), change.option), scene);
    source.overrides.push_back(std::move(change));
}

// Applies the overrides; notes and skips those that cannot be applied.
void apply_overrides(std::span<const std::string> texts, Json& scene, Source& source) {
    if (texts.size() > ParseLimits::overrides) {
        throw InputError("--set", "is given " + std::to_string(texts.size()) + " times",
                         "at most " + std::to_string(ParseLimits::overrides) + " are taken");
    }
    for (const std::string& text : texts) {
        try {
            apply_override(text, scene, source);
        } catch (const InputError& error) {
            source.problems.add_option(error);
        }
    }
}

std::string read_text(const std::filesystem::path& path, const char* kind) {
    const std::string name = path.string();
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) {
        throw InputError(name,
                         std::filesystem::is_directory(path, error) ? "is a folder" : "there is no such file",
                         std::string("give the path of a ") + kind + " file");
    }
    std::ifstream file(path, std::ios::binary);
    std::string text(ParseLimits::bytes + 1, '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    if (file.bad() || (!file && !file.eof()))
        throw InputError(name, "cannot be read", "check its permissions");
    text.resize(static_cast<std::size_t>(file.gcount()));
    return text;
}

// Text of valid length and JSON syntax. Numbers outside the range of double are null in it.
struct Parsed {
    Json json;
    std::vector<UnrepresentableNumber> unheld;
};

Parsed parse_json(std::string_view text, const std::string& name) {
    if (text.size() > ParseLimits::bytes) {
        throw InputError(name, "is longer than " + std::to_string(ParseLimits::bytes) + " bytes",
                         "a scene is a short text, meshes stand in files of their own");
    }
    Parsed out;
    check_json(text, name, ParseLimits::nesting_depth, true, &out.unheld);
    if (out.unheld.empty()) {
        out.json = parse_checked(text, name);
        return out;
    }
    std::string without;
    std::size_t at = 0;
    for (const UnrepresentableNumber& number : out.unheld) {
        without.append(text.substr(at, number.begin - at)).append("null");
        at = number.begin + number.size;
    }
    without.append(text.substr(at));
    out.json = parse_checked(without, name);
    return out;
}

// Notes unrepresentable numbers before values are read, so that no reader reports the null, and after
// overrides, which may replace it.
void note_unrepresentable(const std::vector<UnrepresentableNumber>& unheld, const Source& source) {
    for (const UnrepresentableNumber& number : unheld)
        if (!number.path.empty() && source.override_of(number.path) == nullptr)
            source.note(number.path, number.path,
                        to_string(number.path) + " is " +
                            printable(std::string(source.text.substr(number.begin, number.size)), 30) +
                            ", which is out of range",
                        "numbers have sizes from 1e-307 to 1.7e308");
}

}  // namespace

SceneDescription parse_scene_text(std::string_view text, const std::string& name,
                                  const std::filesystem::path& folder,
                                  std::span<const std::string> overrides) {
    Parsed parsed = parse_json(text, name);
    Source source{
        text, name, std::filesystem::absolute(folder.empty() ? "." : folder).lexically_normal(), {}};
    apply_overrides(overrides, parsed.json, source);
    note_unrepresentable(parsed.unheld, source);
    SceneDescription out = read_scene(Value(source, parsed.json, {}));
    source.raise();
    // Scenes that a run writes must be readable again.
    if (source.repeats && resolved_scene(out).dump().size() > ParseLimits::bytes)
        throw InputError(
            name,
            "is longer than " + std::to_string(ParseLimits::bytes) + " bytes with its copies written out",
            "repeat less often");
    out.deprecations = std::move(source.deprecations);
    return out;
}

SceneDescription parse_scene_file(const std::filesystem::path& path, std::span<const std::string> overrides) {
    if (io::format_of_extension(path))
        throw InputError(path.string(), "is a mesh, not a scene",
                         "cut it as it is with 'splitcubes cut', or name it as a body's mesh in a scene");
    return parse_scene_text(read_text(path, "scene"), path.string(),
                            std::filesystem::absolute(path).parent_path(), overrides);
}

std::vector<ToolDescription> parse_path_text(std::string_view text, const std::string& name) {
    return parse_path_text(text, name, {});
}

std::vector<ToolDescription> parse_path_text(std::string_view text, const std::string& name,
                                             const std::filesystem::path& folder) {
    const Parsed parsed = parse_json(text, name);
    const Source source{text, name, folder, {}};
    note_unrepresentable(parsed.unheld, source);
    std::vector<ToolDescription> out = read_path(Value(source, parsed.json, {}));
    source.raise();
    return out;
}

std::vector<ToolDescription> parse_path_file(const std::filesystem::path& path) {
    return parse_path_text(read_text(path, "path"), path.string(),
                           std::filesystem::absolute(path).parent_path());
}

}  // namespace splitcubes::scene
