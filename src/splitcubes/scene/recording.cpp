#include <splitcubes/core/error.h>
#include <splitcubes/scene/json_location.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/reader.h>
#include <splitcubes/scene/recording.h>
#include <splitcubes/scene/resolve.h>
#include <splitcubes/scene/tuning.h>

#include <cstdint>
#include <fstream>
#include <set>
#include <system_error>
#include <utility>

namespace splitcubes::scene {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* format_name = "splitcubes recording 2";
constexpr std::string_view any_format = "splitcubes recording ";

// Key of a track for each kind of driven object, in the order of body::Driven.
const std::vector<std::string_view> driven_keys = {"tool", "constraint", "handle", "collider"};

std::string poses_text(const SampledMotion& motion) {
    std::string out;
    for (const Isometry& frame : motion.frames()) {
        Json numbers = Json::array();
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 4; ++column) numbers.push_back(frame.matrix()(row, column));
        out += (out.empty() ? "\n      " : ",\n      ") + numbers.dump();
    }
    return out;
}

std::string track_text(const body::MotionTrack& track) {
    return "    {\"" + std::string(driven_keys[static_cast<std::size_t>(track.driven)]) +
           "\": " + Json(track.name).dump() + ",\n     \"times\": " + Json(track.motion.times()).dump() +
           ",\n     \"places\": [" + poses_text(track.motion) + "]}";
}

Isometry read_pose(const Value& value) {
    const std::vector<Value> numbers = value.elements(12, 12);
    Isometry out = Isometry::Identity();
    if (numbers.empty()) return out;
    for (int k = 0; k < 12; ++k) out.matrix()(k / 4, k % 4) = numbers[static_cast<std::size_t>(k)].number();
    const Mat3 turn = out.linear();
    if (value.sound() &&
        !((turn * turn.transpose() - Mat3::Identity()).norm() <= tuning::input::rigid_tolerance &&
          turn.determinant() > 0))
        value.fail("is not a rigid motion", "give a rotation and a position, row by row");
    return out;
}

// Finding a problem's line means scanning the text: for long texts reading stops at the first problem.
bool is_long(const Source& source) {
    return source.text.size() > ParseLimits::bytes;
}

// end: s, of the recorded run; later samples are refused.
body::MotionTrack read_track(const Value& value, double end) {
    const Object object(value, "track");
    body::MotionTrack out;
    for (std::size_t k = 1; k < driven_keys.size(); ++k) {
        for (std::size_t before = 0; before < k; ++before)
            object.not_both(driven_keys[before], driven_keys[k]);
        if (object.has(driven_keys[k])) out.driven = static_cast<body::Driven>(k);
    }
    const Value name = object.at(driven_keys[static_cast<std::size_t>(out.driven)]);
    out.name = name.text();
    if (name.sound() && (out.name.empty() || out.name.size() > RecordingLimits::name_length))
        name.fail("has " + std::to_string(out.name.size()) + " bytes",
                  "give a name of 1 to " + std::to_string(RecordingLimits::name_length) + " bytes");
    const Value times = object.at("times"), poses = object.at("places");
    const std::size_t count = times.element_count(1, RecordingLimits::samples);
    const std::size_t pose_count = poses.element_count(1, RecordingLimits::samples);
    if (count == 0 || pose_count == 0) return out;
    if (count != pose_count) {
        poses.fail("has " + std::to_string(pose_count) + " elements, times has " + std::to_string(count),
                   "give a place for each time");
        return out;
    }
    for (std::size_t k = 0; k < count; ++k) {
        const Value when = times.element(k), where = poses.element(k);
        const double time = when.number(any_time);
        const Isometry pose = read_pose(where);
        if (when.sound() && !out.motion.empty() && !(time > out.motion.times().back()))
            when.fail("does not come after the one before it", "order times");
        if (when.sound() && time > end) when.fail("comes after the end of the recorded run", "take it out");
        if (when.sound() && where.sound())
            out.motion.add(time, pose);
        else if (is_long(value.source()))
            return out;
    }
    return out;
}

// Two tracks for the same object are refused: the last one would win.
std::vector<body::MotionTrack> read_tracks(const Value& value, double end) {
    std::vector<body::MotionTrack> out;
    std::set<std::pair<body::Driven, std::string>> seen;
    for (const Value& track : value.elements(0, RecordingLimits::tracks)) {
        out.push_back(read_track(track, end));
        if (!seen.emplace(out.back().driven, out.back().name).second)
            track.fail("drives '" + printable(out.back().name) + "', which one before it drives",
                       "take one of the two out");
        if (is_long(value.source())) value.source().raise();
    }
    return out;
}

std::string optional_text(const Object& object, std::string_view key) {
    const auto value = object.find(key);
    return value ? value->text() : std::string();
}

}  // namespace

std::string recording_text(const Recording& recording, const std::filesystem::path& folder) {
    const Json head = {{"format", format_name},
                       {"program", recording.program},
                       {"frames", recording.scene.frames},
                       {"first_state", recording.first_state},
                       {"last_state", recording.last_state},
                       {"scene", resolved_scene(recording.scene, folder)}};
    std::string out = head.dump(2);
    out.resize(out.rfind('\n'));
    out += ",\n  \"tracks\": [";
    for (std::size_t k = 0; k < recording.tracks.size(); ++k)
        out += (k == 0 ? "\n" : ",\n") + track_text(recording.tracks[k]);
    return out + "]\n}\n";
}

Recording parse_recording(std::string_view text, const std::string& name,
                          const std::filesystem::path& folder) {
    check_json_within(text, name, ParseLimits::nesting_depth, RecordingLimits::memory);
    const Json json = Json::parse(text, nullptr, false, true);
    if (json.is_discarded()) throw InputError(name, "cannot be read as JSON", "check its syntax");
    const Source source{text, name, folder, {}};
    const std::string format =
        json.is_object() && json.contains("format") && json["format"].is_string() ? json["format"] : "";
    if (!format.starts_with(any_format))
        throw InputError(name, "is not a recording", "give a file that 'run --record' wrote");
    if (format != format_name)
        throw InputError(name,
                         "is a '" + printable(format) + "', which another version wrote; this one reads '" +
                             format_name + "'",
                         "record it again, or replay it with the version that wrote it");
    const Object object(Value(source, json, {}), "recording");
    Recording out;
    const Value scene = object.at("scene");
    source.raise();
    out.scene = parse_scene_text(scene.json().dump(), name + ": scene", folder);
    object.read("frames", out.scene.frames, 1, 1000000);
    out.program = optional_text(object, "program");
    out.first_state = optional_text(object, "first_state");
    out.last_state = optional_text(object, "last_state");
    // The last step ends here, up to rounding.
    const double end =
        object.sound({"frames"}) ? out.scene.time_step * (out.scene.frames + 1e-6) : any_time.high;
    out.tracks = read_tracks(object.at("tracks"), end);
    source.raise();
    return out;
}

Recording read_recording(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error))
        throw InputError(path.string(), "there is no such file", "give a file that 'run --record' wrote");
    const std::uintmax_t size = std::filesystem::file_size(path, error);
    if (size > RecordingLimits::bytes)
        throw InputError(path.string(), "is longer than " + std::to_string(RecordingLimits::bytes) + " bytes",
                         "give a file that 'run --record' wrote");
    std::ifstream file(path, std::ios::binary);
    std::string text(static_cast<std::size_t>(size), '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    if (!file) throw InputError(path.string(), "cannot be read", "check its permissions");
    return parse_recording(text, path.string(), std::filesystem::absolute(path).parent_path());
}

}  // namespace splitcubes::scene
