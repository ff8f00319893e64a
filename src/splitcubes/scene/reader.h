// Checked reading of JSON values that know their path. Internal to scene.
//
// Readers continue after a problem, so that all problems are reported at once: they note the problem and
// return a harmless value. Each invalid value is reported once. Checks that compare values first test that
// these are sound.
#pragma once

#include <splitcubes/math/types.h>
#include <splitcubes/scene/json_path.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/problems.h>

#include <filesystem>
#include <initializer_list>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace splitcubes::scene {

/// A value given from outside the text.
struct Override {
    JsonPath path;
    std::string option;  // as the user gave it, for messages
};

/// Origin of the values; outlives all readers.
struct Source {
    std::string_view text;
    std::string name;
    std::filesystem::path folder;
    std::vector<Override> overrides;  // the last one that covers a value determines it
    mutable Problems problems = {};   // noted by readers so far

    const Override* override_of(const JsonPath& path) const;
    /// Notes a problem at the line of the value `where`, or at the option that set it; one per value `about`.
    /// problem: includes the name of the value concerned. like: identifies the kind of problem, together with
    /// the remedy and regardless of indices; empty: as about. Returns null if one is noted already. Throws
    /// all problems if there are too many.
    Problem* note(const JsonPath& about, const JsonPath& where, const std::string& problem,
                  const std::string& remedy, const JsonPath& like = {}) const;
    /// Throws the problems noted, if there are any.
    void raise() const { problems.raise(name); }
};

/// Interval of valid numbers; an open end is excluded.
struct Range {
    double low = -1e7;
    double high = 1e7;
    bool low_open = false;
    bool high_open = false;
};

// Lengths, coordinates and the like are bounded so that their squares and cubes stay far inside the range of
// double.
inline constexpr Range any_number{};
inline constexpr Range positive{0, 1e7, true, false};
inline constexpr Range not_negative{0, 1e7};
inline constexpr Range any_time{0, 1e6};
inline constexpr Range any_angle{-3.6e5, 3.6e5};

/// A JSON value and the path to it. A missing value, once reported, is void: it accepts all queries and
/// reports nothing more.
class Value {
  public:
    Value(const Source& source, const nlohmann::ordered_json& json, JsonPath path)
        : source_(&source), json_(&json), path_(std::move(path)) {}
    static Value make_void(const Source& source, JsonPath path);

    const Source& source() const { return *source_; }
    const nlohmann::ordered_json& json() const { return *json_; }
    const JsonPath& path() const { return path_; }
    bool is_void() const { return void_; }
    /// Returns whether the value exists and no problem is noted for it or inside it.
    bool sound() const { return !void_ && !source_->problems.within(path_); }
    /// Notes a problem of this value: `bodies[0].cells is -1, ...`.
    void fail(const std::string& problem, const std::string& remedy) const;
    /// Returns the value's text, shortened.
    std::string shown() const;
    /// Returns the value's text with its type.
    std::string shown_with_type() const;

    // Each of these notes an invalid value and then returns a harmless one.

    double number(const Range& range = any_number) const;
    int integer(int low, int high) const;
    bool boolean() const;
    std::string text() const;
    /// Returns non-empty text for display.
    std::string label() const;
    /// Returns text that can be part of a file name. An invalid one is noted and returned too; empty: none.
    std::string identifier() const;
    /// Returns the index of the text among `words`.
    std::size_t choice(const std::vector<std::string_view>& words) const;
    Vec3 vector(const Range& range = any_number) const;
    /// Returns a vector of non-zero length.
    Vec3 direction() const;
    /// Returns the elements of an array, least to most of them; if there are too few, those that exist, but
    /// none if their number is fixed (least = most).
    std::vector<Value> elements(std::size_t min_count, std::size_t max_count) const;
    /// Returns the number of elements, for arrays too long to create a Value for each; element() returns one.
    std::size_t element_count(std::size_t min_count, std::size_t max_count) const;
    Value element(std::size_t index) const;

  private:
    friend class Object;
    // Returns the number if the value is valid; no value if a problem was noted.
    std::optional<double> number_in(const Range& range) const;
    std::optional<int> integer_in(int low, int high) const;
    std::optional<bool> truth() const;
    std::optional<Vec3> vector_in(const Range& range) const;
    std::optional<Vec3> direction_in() const;

    const Source* source_;
    const nlohmann::ordered_json* json_;
    JsonPath path_;
    bool void_ = false;
};

/// A JSON object whose keys belong to one of scene_keys(), path_keys() or recording_keys().
class Object {
  public:
    /// Notes values that are not objects, and unknown keys with the nearest known one. A missing key is read
    /// under a similar unknown one.
    Object(const Value& value, std::string_view kind);

    const Value& value() const { return value_; }
    bool has(std::string_view key) const;
    /// Returns the key's value; a missing key is noted and its value void.
    Value at(std::string_view key) const;
    /// Returns the key's value unless it is absent or null.
    std::optional<Value> find(std::string_view key) const;
    /// Returns the key of an object that must have exactly one; if it does not, notes it and returns an empty
    /// key, whose value is void.
    std::string_view only_key() const;
    /// Notes a problem if both keys are given.
    void not_both(std::string_view first, std::string_view second) const;
    /// Returns whether the values under these keys are free of problems; absent ones are, unless at() was
    /// called for them.
    bool sound(std::initializer_list<std::string_view> keys) const;

    // Each of these leaves `out` unchanged if the key is absent or its value invalid.
    void read(std::string_view key, double& out, const Range& range = any_number) const;
    void read(std::string_view key, int& out, int low, int high) const;
    void read(std::string_view key, bool& out) const;
    void read(std::string_view key, Vec3& out, const Range& range = any_number) const;
    void read_direction(std::string_view key, Vec3& out) const;
    void read_optional(std::string_view key, std::optional<double>& out, const Range& range) const;

  private:
    void note_unknown(const std::string& key);
    void note_deprecated(const DeprecatedKey& key);
    std::string written(std::string_view key) const;
    JsonPath path_of(std::string_view key) const;

    Value value_;
    const std::vector<std::string_view>* keys_;
    // Known keys that are read under unknown ones: (known, as written).
    std::vector<std::pair<std::string_view, std::string>> renamed_;
    std::vector<std::string> unknown_keys_;  // unknown keys without a similar known one
};

}  // namespace splitcubes::scene
