// Checked reading of JSON values that know where they stand. Internal to scene.
#pragma once

#include <splitcubes/math/types.h>
#include <splitcubes/scene/json_path.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace splitcubes::scene {

/// A value set from outside the text.
struct Override {
    JsonPath path;
    std::string option;  // as the user gave it, for messages
};

/// Where the values come from; outlives all readers.
struct Source {
    std::string_view text;
    std::string name;
    std::filesystem::path folder;
    std::vector<Override> overrides;  // the last one that covers a value made it

    const Override* override_of(const JsonPath& path) const;
    /// `file:line`, or the option that set what is there.
    std::string place_of(const JsonPath& path) const;
};

/// Throws InputError at the value's line, or at the option that set it. The
/// problem follows the value's path: `bodies[0].cells is -1, ...`.
[[noreturn]] void fail(const Source& source, const JsonPath& path, const std::string& problem,
                       const std::string& remedy);

/// Numbers allowed; an open end is itself not allowed.
struct Range {
    double low = -1e7;
    double high = 1e7;
    bool low_open = false;
    bool high_open = false;
};

// Lengths, coordinates and the like are bounded so that their squares and cubes
// stay far inside what a double holds.
inline constexpr Range any_number{};
inline constexpr Range positive{0, 1e7, true, false};
inline constexpr Range not_negative{0, 1e7};
inline constexpr Range any_time{0, 1e6};
inline constexpr Range any_angle{-3.6e5, 3.6e5};

/// A JSON value and the way to it.
class Value {
  public:
    Value(const Source& source, const nlohmann::ordered_json& json, JsonPath path)
        : source_(&source), json_(&json), path_(std::move(path)) {}

    const Source& source() const { return *source_; }
    const nlohmann::ordered_json& json() const { return *json_; }
    const JsonPath& path() const { return path_; }
    [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const {
        scene::fail(*source_, path_, problem, remedy);
    }
    /// The value as it stands, shortened.
    std::string shown() const;
    /// The same with what kind of value it is.
    std::string shown_with_type() const;

    double number(const Range& range = any_number) const;
    int integer(int low, int high) const;
    bool boolean() const;
    std::string text() const;
    /// Text to show to people, not empty.
    std::string label() const;
    /// Text that can be part of a file name.
    std::string identifier() const;
    /// Index of the text among `words`.
    std::size_t choice(const std::vector<std::string_view>& words) const;
    Vec3 vector(const Range& range = any_number) const;
    /// A vector with a length above zero.
    Vec3 direction() const;
    /// The elements of an array, least to most of them.
    std::vector<Value> elements(std::size_t least, std::size_t most) const;

  private:
    const Source* source_;
    const nlohmann::ordered_json* json_;
    JsonPath path_;
};

/// A JSON object all of whose keys belong to one of scene_keys(), path_keys() or recording_keys().
class Object {
  public:
    /// Throws on what is no object and on unknown keys, with the nearest known one.
    Object(const Value& value, std::string_view kind);

    const Value& value() const { return value_; }
    bool has(std::string_view key) const;
    /// The key's value; throws when there is none.
    Value at(std::string_view key) const;
    /// The key's value unless it is absent or null.
    std::optional<Value> find(std::string_view key) const;
    /// The key and value of an object that must have exactly one key.
    std::string_view only_key() const;
    /// Throws when both are given.
    void not_both(std::string_view first, std::string_view second) const;

    // Each leaves `out` as it is where the key is absent.
    void read(std::string_view key, double& out, const Range& range = any_number) const;
    void read(std::string_view key, int& out, int low, int high) const;
    void read(std::string_view key, bool& out) const;
    void read(std::string_view key, Vec3& out, const Range& range = any_number) const;
    void read_direction(std::string_view key, Vec3& out) const;
    void read_optional(std::string_view key, std::optional<double>& out, const Range& range) const;

  private:
    Value value_;
    const std::vector<std::string_view>* keys_;
};

}  // namespace splitcubes::scene
