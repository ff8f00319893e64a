// Checked reading of JSON values that know where they stand. Internal to scene.
//
// Readers go on after what is wrong, so that all problems are reported together: they note the problem and
// return a harmless value. A value that is wrong is complained of once. Checks that compare values
// ask first whether these are sound.
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

/// A value set from outside the text.
struct Override {
    JsonPath path;
    std::string option;  // as the user gave it, for messages
};

/// Source of the values; outlives all readers.
struct Source {
    std::string_view text;
    std::string name;
    std::filesystem::path folder;
    std::vector<Override> overrides;                     // the last one that covers a value made it
    mutable Problems problems = {};                      // that readers found so far
    mutable std::vector<std::string> deprecations = {};  // one line each, of deprecated keys that were read
    mutable bool repeats = false;                        // whether a thing was repeated

    const Override* override_of(const JsonPath& path) const;
    /// Notes a problem at the line of the value `where`, or at the option that set it; one for each
    /// value `about`. problem: with the name of what has it; like: problems of one kind have it in common,
    /// but for indices, and the remedy; empty: as about. Null where one is noted already. Throws all when
    /// there are too many.
    Problem* note(const JsonPath& about, const JsonPath& where, const std::string& problem,
                  const std::string& remedy, const JsonPath& like = {}) const;
    /// Throws what was noted, if anything was.
    void raise() const { problems.raise(name); }
};

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

/// A JSON value and its path. A missing one, for which a problem was reported, is void:
/// it accepts every query and reports nothing more.
class Value {
  public:
    Value(const Source& source, const nlohmann::ordered_json& json, JsonPath path)
        : source_(&source), json_(&json), path_(std::move(path)) {}
    static Value make_void(const Source& source, JsonPath path);

    const Source& source() const { return *source_; }
    const nlohmann::ordered_json& json() const { return *json_; }
    const JsonPath& path() const { return path_; }
    bool is_void() const { return void_; }
    /// Tells whether it is there and nothing is known to be wrong with it or in it.
    bool sound() const { return !void_ && !source_->problems.within(path_); }
    /// Notes a problem of this value: `bodies[0].cells is -1, ...`.
    void fail(const std::string& problem, const std::string& remedy) const;
    /// The value as it stands, shortened.
    std::string shown() const;
    /// The same with what kind of value it is.
    std::string shown_with_type() const;

    // Each notes what is wrong and then returns something harmless.

    double number(const Range& range = any_number) const;
    int integer(int low, int high) const;
    bool boolean() const;
    std::string text() const;
    /// Text to show to people, not empty.
    std::string label() const;
    /// Text that can be part of a file name; one that cannot is returned as well, empty is none.
    std::string identifier() const;
    /// Index of the text among `words`.
    std::size_t choice(const std::vector<std::string_view>& words) const;
    Vec3 vector(const Range& range = any_number) const;
    /// A vector with a length above zero.
    Vec3 direction() const;
    /// Returns the elements of an array, least to most of them; if there are too few, those, but none if
    /// their number is fixed (least = most).
    std::vector<Value> elements(std::size_t min_count, std::size_t max_count) const;
    /// Return the number of elements, and one element: for arrays too long to have a Value for each.
    std::size_t element_count(std::size_t min_count, std::size_t max_count) const;
    Value element(std::size_t index) const;

  private:
    friend class Object;
    // Return the value if it is valid; none: a problem was reported.
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

/// A JSON object all of whose keys belong to one of scene_keys(), path_keys() or recording_keys().
class Object {
  public:
    /// Notes what is no object, and unknown keys with the nearest known one. A key that is missing and
    /// has an unknown one near it is read under that.
    Object(const Value& value, std::string_view kind);

    const Value& value() const { return value_; }
    bool has(std::string_view key) const;
    /// The key's value; void when there is none, which is noted.
    Value at(std::string_view key) const;
    /// The key's value unless it is absent or null.
    std::optional<Value> find(std::string_view key) const;
    /// The key of an object that must have exactly one; empty, whose value is void, where it has not.
    std::string_view only_key() const;
    /// Notes it when both are given.
    void not_both(std::string_view first, std::string_view second) const;
    /// Tells whether nothing is wrong with what stands under these keys; absent ones are right unless they
    /// were queried by at().
    bool sound(std::initializer_list<std::string_view> keys) const;

    // Each leaves `out` as it is where the key is absent or its value is wrong.
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
    const ObjectKeys* kind_;
    const std::vector<std::string_view>* keys_;  // of the kind
    // Known keys that are read under unknown ones: (known, as it is written).
    std::vector<std::pair<std::string_view, std::string>> renamed_;
    std::vector<std::string> unknown_keys_;  // that are not similar to a known one
};

}  // namespace splitcubes::scene
