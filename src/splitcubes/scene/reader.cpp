#include <splitcubes/core/error.h>
#include <splitcubes/scene/json_location.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/reader.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <numeric>

namespace splitcubes::scene {

namespace {

std::string format_number(double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.6g", value);
    return buffer;
}

std::string format_range(const Range& range) {
    return (range.low_open ? "above " : "from ") + format_number(range.low) +
           (range.high_open ? " to below " : " to ") + format_number(range.high);
}

bool inside(const Range& range, double value) {
    return (range.low_open ? value > range.low : value >= range.low) &&
           (range.high_open ? value < range.high : value <= range.high);
}

// Levenshtein's distance: letters put in, taken out or exchanged.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t exchanged = diagonal + (a[i] == b[j] ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({exchanged, row[j] + 1, row[j + 1] + 1});
        }
    }
    return row[b.size()];
}

std::string list(const std::vector<std::string_view>& words) {
    std::string out;
    for (const std::string_view word : words) {
        if (!out.empty()) out += ", ";
        out += word;
    }
    return out;
}

std::string suggestion(const std::string& word, const std::vector<std::string_view>& known) {
    // A long unknown key costs no more than a short one.
    const std::string_view start = std::string_view(word).substr(0, 100);
    const auto nearest = std::min_element(known.begin(), known.end(), [&](auto a, auto b) {
        return edit_distance(start, a) < edit_distance(start, b);
    });
    const std::size_t far_off = std::max<std::size_t>(2, start.size() / 3);
    if (nearest != known.end() && edit_distance(start, *nearest) <= far_off) {
        return "did you mean '" + std::string(*nearest) + "'?";
    }
    return "known here: " + list(known);
}

const char* type_name(const nlohmann::ordered_json& json) {
    if (json.is_object()) return "an object";
    if (json.is_array()) return "an array";
    if (json.is_string()) return "a text";
    if (json.is_boolean()) return "true or false";
    if (json.is_number()) return "a number";
    return "null";
}

JsonPath extended(JsonPath path, PathStep step) {
    path.push_back(std::move(step));
    return path;
}

const std::vector<std::string_view>& keys_of(std::string_view kind) {
    for (const std::vector<ObjectKeys>* all : {&scene_keys(), &path_keys(), &recording_keys()})
        for (const ObjectKeys& object : *all)
            if (object.object == kind) return object.keys;
    assert(false && "no kind of object has that name");
    return scene_keys().front().keys;
}

}  // namespace

const Override* Source::override_of(const JsonPath& path) const {
    const auto found = std::find_if(overrides.rbegin(), overrides.rend(),
                                    [&](const Override& o) { return is_within(path, o.path); });
    return found == overrides.rend() ? nullptr : &*found;
}

std::string Source::place_of(const JsonPath& path) const {
    if (const Override* origin = override_of(path)) return origin->option;
    std::string place = name + ":" + std::to_string(line_of(text, path));
    // What is wrong with an object may come from an option that set a part of it.
    const auto part = std::find_if(overrides.begin(), overrides.end(), [&](const Override& o) {
        return !path.empty() && is_within(o.path, path);
    });
    if (part != overrides.end()) place += " with " + part->option;
    return place;
}

void fail(const Source& source, const JsonPath& path, const std::string& problem, const std::string& remedy) {
    throw InputError(source.place_of(path), to_string(path) + " " + problem, remedy);
}

std::string Value::shown() const {
    return printable(json_->dump());
}

std::string Value::shown_with_type() const {
    return json_->is_null() ? shown() : shown() + ", " + type_name(*json_);
}

double Value::number(const Range& range) const {
    if (!json_->is_number()) {
        fail("is " + shown_with_type(), "give a number " + format_range(range));
    }
    const auto value = json_->get<double>();
    if (!inside(range, value)) {
        fail("is " + shown() + ", which is out of range", "give a number " + format_range(range));
    }
    return value;
}

int Value::integer(int low, int high) const {
    const std::string remedy =
        "give a whole number from " + std::to_string(low) + " to " + std::to_string(high);
    if (!json_->is_number()) fail("is " + shown_with_type(), remedy);
    const auto value = json_->get<double>();
    if (value != std::floor(value)) fail("is " + shown() + ", not a whole number", remedy);
    if (value < low || value > high) fail("is " + shown() + ", which is out of range", remedy);
    return static_cast<int>(value);
}

bool Value::boolean() const {
    if (!json_->is_boolean()) fail("is " + shown_with_type(), "write true or false");
    return json_->get<bool>();
}

std::string Value::text() const {
    if (!json_->is_string()) fail("is " + shown_with_type(), "give a text in quotes");
    return json_->get<std::string>();
}

std::string Value::label() const {
    const std::string out = text();
    const bool control = std::any_of(
        out.begin(), out.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
    if (out.empty() || out.size() > ParseLimits::name_length || control) {
        fail("is " + shown() + ", which is no name",
             "give 1 to " + std::to_string(ParseLimits::name_length) + " characters on one line");
    }
    return out;
}

std::string Value::identifier() const {
    const std::string out = label();
    const auto good = [](char c) { return (is_path_word(c) && c != '$') || c == '.'; };
    if (!std::all_of(out.begin(), out.end(), good) || out[0] == '.' || out[0] == '-') {
        fail("is " + shown() + ", which cannot be part of a file name",
             "use letters, digits, '_', '-' and '.', not '-' or '.' first");
    }
    return out;
}

std::size_t Value::choice(const std::vector<std::string_view>& words) const {
    const std::string word = text();
    const auto found = std::find(words.begin(), words.end(), word);
    if (found == words.end()) {
        fail("is " + shown() + ", which is unknown", "give one of " + list(words));
    }
    return static_cast<std::size_t>(found - words.begin());
}

Vec3 Value::vector(const Range& range) const {
    const std::vector<Value> parts = elements(3, 3);
    return {parts[0].number(range), parts[1].number(range), parts[2].number(range)};
}

Vec3 Value::direction() const {
    const Vec3 out = vector();
    if (out.norm() < 1e-6)
        fail("is " + shown() + ", too short for a direction", "give a vector like [0, 0, 1]");
    return out;
}

std::vector<Value> Value::elements(std::size_t least, std::size_t most) const {
    const std::string remedy =
        "give an array of " +
        (least == most ? std::to_string(least) : std::to_string(least) + " to " + std::to_string(most)) +
        " elements";
    if (!json_->is_array()) fail("is " + shown_with_type(), remedy);
    if (json_->size() < least || json_->size() > most) {
        fail("has " + std::to_string(json_->size()) + " elements: " + shown(), remedy);
    }
    std::vector<Value> out;
    out.reserve(json_->size());
    for (std::size_t i = 0; i < json_->size(); ++i) {
        out.emplace_back(*source_, (*json_)[i], extended(path_, {"", static_cast<int>(i)}));
    }
    return out;
}

Object::Object(const Value& value, std::string_view kind) : value_(value), keys_(&keys_of(kind)) {
    const auto& json = value.json();
    if (!json.is_object()) {
        value.fail("is " + value.shown_with_type(), "give an object { } with " + list(*keys_));
    }
    for (const auto& item : json.items()) {
        if (std::find(keys_->begin(), keys_->end(), item.key()) != keys_->end()) continue;
        throw InputError(value.source().place_of(extended(value.path(), {item.key(), -1})),
                         to_string(value.path()) + " has the unknown key '" + printable(item.key()) + "'",
                         suggestion(item.key(), *keys_));
    }
}

bool Object::has(std::string_view key) const {
    assert(std::find(keys_->begin(), keys_->end(), key) != keys_->end());
    return value_.json().contains(key);
}

Value Object::at(std::string_view key) const {
    if (!has(key)) value_.fail("has no '" + std::string(key) + "'", "add it, it is needed");
    return {value_.source(), value_.json().at(std::string(key)),
            extended(value_.path(), {std::string(key), -1})};
}

std::optional<Value> Object::find(std::string_view key) const {
    if (!has(key)) return std::nullopt;
    Value value = at(key);
    if (value.json().is_null()) return std::nullopt;
    return value;
}

std::string_view Object::only_key() const {
    const auto& json = value_.json();
    if (json.size() != 1) {
        value_.fail("has " + std::to_string(json.size()) + " keys: " + value_.shown(),
                    "give exactly one of " + list(*keys_));
    }
    return *std::find(keys_->begin(), keys_->end(), json.begin().key());
}

void Object::not_both(std::string_view first, std::string_view second) const {
    if (!find(first) || !find(second)) return;
    // Blamed is what was said on the command line, else the second.
    const bool blame_first = value_.source().override_of(at(first).path()) != nullptr;
    at(blame_first ? first : second)
        .fail(
            "is given beside '" + std::string(blame_first ? second : first) + "'",
            "take one of the two out (as an option: " + std::string(blame_first ? second : first) + "=null)");
}

void Object::read(std::string_view key, double& out, const Range& range) const {
    if (has(key)) out = at(key).number(range);
}
void Object::read(std::string_view key, int& out, int low, int high) const {
    if (has(key)) out = at(key).integer(low, high);
}
void Object::read(std::string_view key, bool& out) const {
    if (has(key)) out = at(key).boolean();
}
void Object::read(std::string_view key, Vec3& out, const Range& range) const {
    if (has(key)) out = at(key).vector(range);
}
void Object::read_direction(std::string_view key, Vec3& out) const {
    if (has(key)) out = at(key).direction();
}
void Object::read_optional(std::string_view key, std::optional<double>& out, const Range& range) const {
    if (const auto value = find(key)) out = value->number(range);
}

}  // namespace splitcubes::scene
