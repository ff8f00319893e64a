#include "commands.h"

#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <string_view>

#include <nlohmann/json.hpp>

namespace splitcubes::view {

namespace {

using Json = nlohmann::ordered_json;

// Those of CommandKind that are recorded, in its order.
constexpr std::array<std::string_view, 13> names = {
    "set_parameter", "apply_preset", "undo",     "redo", "begin_stroke", "move_stroke", "end_stroke",
    "begin_pull",    "move_pull",    "end_pull", "pin",  "unpin",        "drop"};
constexpr std::string_view mark = "splitcubes viewer recording 1";

Json numbers(const Vec3& v) {
    return {v.x(), v.y(), v.z()};
}

Vec3 vector_of(const Json& json) {
    Vec3 out;
    for (std::size_t k = 0; k < 3; ++k) out[static_cast<int>(k)] = json.at(k).get<double>();
    if (!out.allFinite()) throw std::domain_error("not finite");
    return out;
}

// Row by row; numbers keep all their digits.
Json frame_numbers(const Isometry& frame) {
    Json out = Json::array();
    for (int k = 0; k < 12; ++k) out.push_back(frame.matrix()(k / 4, k % 4));
    return out;
}

Isometry frame_of(const Json& json) {
    Isometry out = Isometry::Identity();
    for (std::size_t k = 0; k < 12; ++k)
        out.matrix()(static_cast<int>(k / 4), static_cast<int>(k % 4)) = json.at(k).get<double>();
    if (!out.matrix().allFinite()) throw std::domain_error("not finite");
    return out;
}

Json anchor_json(const MaterialPoint& anchor) {
    return {{"body", anchor.body},
            {"vertices", anchor.vertices},
            {"weights", anchor.weights},
            {"rest", numbers(anchor.rest)},
            {"world", numbers(anchor.world)}};
}

MaterialPoint anchor_of(const Json& json) {
    MaterialPoint out;
    out.body = json.at("body").get<std::size_t>();
    out.vertices = json.at("vertices").get<std::array<std::uint32_t, 3>>();
    out.weights = json.at("weights").get<std::array<double, 3>>();
    out.rest = vector_of(json.at("rest"));
    out.world = vector_of(json.at("world"));
    return out;
}

Json command_json(const RecordedCommand& recorded) {
    const Command& c = recorded.command;
    Json out;
    out["step"] = recorded.step;
    out["command"] = names[static_cast<std::size_t>(c.kind)];
    if (c.slot != 0) out["slot"] = c.slot;
    if (!c.name.empty()) out["name"] = c.name;
    if (c.value != 0) out["value"] = c.value;
    if (c.radius != 0) out["radius"] = c.radius;
    if (c.limit != 0) out["limit"] = c.limit;
    if (c.partner != 0) out["partner"] = c.partner;
    for (const Vec3& p : c.points) out["points"].push_back(numbers(p));
    for (const Isometry& frame : c.frames) out["frames"].push_back(frame_numbers(frame));
    if (c.frames_per_step != 0) out["frames_per_step"] = c.frames_per_step;
    if (c.has_anchor) out["anchor"] = anchor_json(c.anchor);
    return out;
}

CommandKind kind_of(const std::string& name) {
    for (std::size_t k = 0; k < names.size(); ++k)
        if (names[k] == name) return static_cast<CommandKind>(k);
    throw std::domain_error("unknown command");
}

RecordedCommand command_of(const Json& json) {
    RecordedCommand out;
    Command& c = out.command;
    out.step = json.at("step").get<std::int64_t>();
    c.kind = kind_of(json.at("command").get<std::string>());
    c.slot = json.value("slot", 0);
    c.name = json.value("name", "");
    c.value = json.value("value", 0.0);
    c.radius = json.value("radius", 0.0);
    c.limit = json.value("limit", 0.0);
    c.partner = json.value("partner", 0);
    c.frames_per_step = json.value("frames_per_step", 0);
    if (json.contains("points"))
        for (const Json& p : json["points"]) c.points.push_back(vector_of(p));
    if (json.contains("frames"))
        for (const Json& frame : json["frames"]) c.frames.push_back(frame_of(frame));
    c.has_anchor = json.contains("anchor");
    if (c.has_anchor) c.anchor = anchor_of(json["anchor"]);
    return out;
}

std::string hexadecimal(std::uint64_t value) {
    std::array<char, 17> text{};
    const auto end = std::to_chars(text.data(), text.data() + 16, value, 16).ptr;
    return {text.data(), end};
}

}  // namespace

bool is_recorded(CommandKind kind) {
    return static_cast<std::size_t>(kind) < names.size();
}

void write_session_recording(const std::filesystem::path& file, const Recording& recording) {
    Json head;
    head["format"] = mark;
    head["scene"] = std::filesystem::absolute(recording.scene).lexically_normal().string();
    if (!recording.initial.empty()) head["parameters"] = recording.initial;
    head["steps"] = recording.steps;
    head["state_hash"] = hexadecimal(recording.state_hash);
    std::string text = head.dump() + '\n';
    for (const RecordedCommand& one : recording.commands) text += command_json(one).dump() + '\n';
    write_file(file, text);
}

Recording read_session_recording(const std::filesystem::path& file) {
    std::ifstream in(file);
    if (!in) throw InputError(file.string(), "cannot be read", "give a recording that the viewer saved");
    Recording out;
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        const std::string where = file.string() + ":" + std::to_string(number);
        try {
            const Json json = Json::parse(line);
            if (number > 1) {
                out.commands.push_back(command_of(json));
                continue;
            }
            if (json.at("format").get<std::string>() != mark) throw std::domain_error("format");
            out.scene = json.at("scene").get<std::string>();
            if (json.contains("parameters"))
                out.initial = json["parameters"].get<std::map<std::string, double>>();
            out.steps = json.at("steps").get<std::int64_t>();
            out.state_hash = std::stoull(json.at("state_hash").get<std::string>(), nullptr, 16);
        } catch (const std::exception&) {
            throw InputError(where, "is no line of a recording ('" + printable(line) + "')",
                             "give a file that the viewer saved as a recording");
        }
    }
    if (out.scene.empty())
        throw InputError(file.string(), "is empty", "give a recording that the viewer saved");
    return out;
}

bool is_recording(const std::filesystem::path& file) {
    std::ifstream in(file);
    std::string line;
    return std::getline(in, line) && line.find(mark) != std::string::npos;
}

}  // namespace splitcubes::view
