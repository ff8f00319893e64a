#include "input.h"

#include <splitcubes/core/error.h>

#include <array>
#include <cmath>
#include <fstream>
#include <string_view>

#include <nlohmann/json.hpp>

namespace splitcubes::view {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<std::string_view, 9> kind_names = {"move", "press", "release", "wheel",   "key",
                                                        "set",  "act",   "resize",  "six_axis"};
constexpr std::array<std::string_view, 3> button_names = {"left", "right", "middle"};

template <std::size_t N>
std::size_t index_of(const std::array<std::string_view, N>& names, const std::string& name,
                     const std::string& where, const char* what) {
    for (std::size_t k = 0; k < N; ++k)
        if (names[k] == name) return k;
    std::string all;
    for (const std::string_view one : names) all += (all.empty() ? "" : ", ") + std::string(one);
    throw InputError(where, std::string("has an unknown ") + what + " ('" + printable(name) + "')",
                     "use one of: " + all);
}

bool has_position(InputKind kind) {
    return kind == InputKind::move || kind == InputKind::press || kind == InputKind::release ||
           kind == InputKind::resize;
}

double number_at(const Json& json, const char* key, const std::string& where) {
    if (!json.contains(key)) return 0;
    if (!json[key].is_number() || !std::isfinite(json[key].get<double>()))
        throw InputError(where, std::string("'") + key + "' is no finite number", "give a number");
    return json[key].get<double>();
}

std::string text_at(const Json& json, const char* key, const std::string& where) {
    if (!json.contains(key)) return {};
    if (!json[key].is_string()) throw InputError(where, std::string("'") + key + "' is no text");
    return json[key].get<std::string>();
}

std::array<double, 6> axes_at(const Json& json, const std::string& where) {
    std::array<double, 6> out{};
    const bool is_list =
        json.contains("axes") && json["axes"].is_array() && json["axes"].size() == out.size();
    for (std::size_t k = 0; k < out.size(); ++k) {
        if (!is_list || !json["axes"][k].is_number() || !std::isfinite(json["axes"][k].get<double>()))
            throw InputError(where, "'axes' is no list of six numbers", "give shifts and turns");
        out[k] = json["axes"][k].get<double>();
    }
    return out;
}

}  // namespace

std::string input_line(const ViewerInput& input) {
    Json out;
    out["frame"] = input.frame;
    out["time"] = input.time;
    out["kind"] = kind_names[static_cast<std::size_t>(input.kind)];
    if (has_position(input.kind)) {
        out["x"] = input.x;
        out["y"] = input.y;
    }
    if (input.kind == InputKind::press || input.kind == InputKind::release)
        out["button"] = button_names[static_cast<std::size_t>(input.button)];
    if (input.modifiers != 0) out["modifiers"] = input.modifiers;
    if (!input.name.empty()) out["name"] = input.name;
    if (input.kind == InputKind::wheel || input.kind == InputKind::set) out["value"] = input.value;
    if (!input.text.empty()) out["text"] = input.text;
    if (input.kind == InputKind::six_axis) out["axes"] = input.axes;
    return out.dump();
}

ViewerInput input_of_line(const std::string& line, const std::string& where) {
    const Json json = Json::parse(line, nullptr, false);
    if (!json.is_object())
        throw InputError(where, "is no JSON object ('" + printable(line) + "')",
                         R"(write lines like {"frame":1,"kind":"key","name":"space"})");
    ViewerInput out;
    out.kind = static_cast<InputKind>(index_of(kind_names, text_at(json, "kind", where), where, "kind"));
    const double frame = number_at(json, "frame", where);
    if (frame < 0 || frame > 1e9) throw InputError(where, "has a frame out of range", "count from 0");
    out.frame = static_cast<int>(frame);
    out.time = number_at(json, "time", where);
    out.x = number_at(json, "x", where);
    out.y = number_at(json, "y", where);
    if (json.contains("button"))
        out.button =
            static_cast<Button>(index_of(button_names, text_at(json, "button", where), where, "button"));
    const double modifiers = number_at(json, "modifiers", where);
    if (!(modifiers >= 0 && modifiers <= 7))
        throw InputError(where, "has modifiers out of range", "give 0 to 7");
    out.modifiers = static_cast<unsigned>(modifiers);
    out.name = text_at(json, "name", where);
    out.value = number_at(json, "value", where);
    out.text = text_at(json, "text", where);
    if (out.kind == InputKind::six_axis) out.axes = axes_at(json, where);
    return out;
}

std::vector<ViewerInput> read_inputs(const std::filesystem::path& file) {
    std::ifstream in(file);
    if (!in)
        throw InputError(file.string(), "cannot be read", "give a file that `view --record-input` wrote");
    std::vector<ViewerInput> out;
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        if (line.find_first_not_of(" \t\r") == std::string::npos || line.starts_with("//")) continue;
        const std::string where = file.string() + ":" + std::to_string(number);
        out.push_back(input_of_line(line, where));
        if (out.size() > 1 && out.back().frame < out[out.size() - 2].frame)
            throw InputError(where,
                             "comes before the line above (frame " + std::to_string(out.back().frame) + ")",
                             "order the lines by frame");
    }
    return out;
}

}  // namespace splitcubes::view
