#include <splitcubes/core/error.h>
#include <splitcubes/core/nearest_word.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/scene/json_location.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/plain_json.h>
#include <splitcubes/scene/reader.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace splitcubes::scene {

namespace {

std::string format_range(const Range& range) {
    return (range.low_open ? "above " : "from ") + plain_number(range.low) +
           (range.high_open ? " to below " : " to ") + plain_number(range.high);
}

bool inside(const Range& range, double value) {
    return (range.low_open ? value > range.low : value >= range.low) &&
           (range.high_open ? value < range.high : value <= range.high);
}

// Returns some number of the range, in place of an invalid one.
double harmless(const Range& range) {
    return inside(range, 1) ? 1 : 0.5 * (range.low + range.high);
}

std::string list(const std::vector<std::string_view>& words) {
    std::string out;
    for (const std::string_view word : words) {
        if (!out.empty()) out += ", ";
        out += word;
    }
    return out;
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

const ObjectKeys& keys_of(std::string_view kind) {
    for (const std::vector<ObjectKeys>* all : {&scene_keys(), &path_keys(), &recording_keys()})
        for (const ObjectKeys& object : *all)
            if (object.object == kind) return object;
    assert(false && "no kind of object has that name");
    return scene_keys().front();
}

// Returns the kind of a path: elements of one array are of one kind.
std::string kind_of(JsonPath path) {
    for (PathStep& step : path)
        if (step.index >= 0) step.index = 0;
    return to_string(path);
}

}  // namespace

const Override* Source::override_of(const JsonPath& path) const {
    const auto found = std::find_if(overrides.rbegin(), overrides.rend(),
                                    [&](const Override& o) { return is_within(path, o.path); });
    return found == overrides.rend() ? nullptr : &*found;
}

Problem* Source::note(const JsonPath& about, const JsonPath& where, const std::string& problem,
                      const std::string& remedy, const JsonPath& like) const {
    if (problems.at(about) != nullptr) return nullptr;
    if (problems.full()) raise();
    Problem out{"", 0, problem, remedy, about};
    out.kind = kind_of(like.empty() ? about : like) + '\n' + remedy;
    if (const Override* origin = override_of(where)) {
        out.location = origin->option;
    } else if (!problems.wants_location(out.kind)) {
        out.unplaced = true;
    } else {
        out.line = line_of(text, where);
        out.location = name + ":" + std::to_string(out.line);
        // The fault of an object may come from an override of one of its parts.
        const auto part = std::find_if(overrides.begin(), overrides.end(), [&](const Override& o) {
            return !where.empty() && is_within(o.path, where);
        });
        if (part != overrides.end()) out.location += " with " + part->option;
    }
    return problems.add(std::move(out));
}

Value Value::make_void(const Source& source, JsonPath path) {
    static const nlohmann::ordered_json nothing;
    Value out(source, nothing, std::move(path));
    out.void_ = true;
    return out;
}

void Value::fail(const std::string& problem, const std::string& remedy) const {
    if (!void_) source_->note(path_, path_, to_string(path_) + " " + problem, remedy);
}

std::string Value::shown() const {
    return printable(plain_json(*json_));
}

std::string Value::shown_with_type() const {
    return json_->is_null() ? shown() : shown() + ", " + type_name(*json_);
}

std::optional<double> Value::number_in(const Range& range) const {
    if (!json_->is_number()) {
        fail("is " + shown_with_type(), "give a number " + format_range(range));
        return std::nullopt;
    }
    const auto value = json_->get<double>();
    if (inside(range, value)) return value;
    fail("is " + shown() + ", which is out of range", "give a number " + format_range(range));
    return std::nullopt;
}

double Value::number(const Range& range) const {
    return number_in(range).value_or(harmless(range));
}

std::optional<int> Value::integer_in(int low, int high) const {
    const std::string remedy =
        "give a whole number from " + std::to_string(low) + " to " + std::to_string(high);
    const double value = json_->is_number() ? json_->get<double>() : 0;
    if (!json_->is_number()) {
        fail("is " + shown_with_type(), remedy);
    } else if (value != std::floor(value)) {
        fail("is " + shown() + ", not a whole number", remedy);
    } else if (value < low || value > high) {
        fail("is " + shown() + ", which is out of range", remedy);
    } else {
        return static_cast<int>(value);
    }
    return std::nullopt;
}

int Value::integer(int low, int high) const {
    return integer_in(low, high).value_or(low);
}

std::optional<bool> Value::truth() const {
    if (json_->is_boolean()) return json_->get<bool>();
    fail("is " + shown_with_type(), "write true or false");
    return std::nullopt;
}

bool Value::boolean() const {
    return truth().value_or(false);
}

std::string Value::text() const {
    if (json_->is_string()) return json_->get<std::string>();
    fail("is " + shown_with_type(), "give a text in quotes");
    return "";
}

std::string Value::label() const {
    const std::string out = text();
    const bool control = std::any_of(
        out.begin(), out.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
    if (out.empty() || out.size() > ParseLimits::name_length || control) {
        fail("is " + shown() + ", which is not a name",
             "give 1 to " + std::to_string(ParseLimits::name_length) + " characters on one line");
    }
    return out;
}

std::string Value::identifier() const {
    const std::string out = label();
    if (out.empty()) return out;
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
        return 0;
    }
    return static_cast<std::size_t>(found - words.begin());
}

std::optional<Vec3> Value::vector_in(const Range& range) const {
    const std::vector<Value> parts = elements(3, 3);
    if (parts.empty()) return std::nullopt;
    Vec3 out;
    bool good = true;
    for (int k = 0; k < 3; ++k) {
        const std::optional<double> part = parts[static_cast<std::size_t>(k)].number_in(range);
        good = good && part;
        out[k] = part.value_or(0);
    }
    return good ? std::optional<Vec3>(out) : std::nullopt;
}

Vec3 Value::vector(const Range& range) const {
    return vector_in(range).value_or(Vec3::Constant(harmless(range)));
}

std::optional<Vec3> Value::direction_in() const {
    const std::optional<Vec3> out = vector_in(any_number);
    if (!out || out->norm() >= 1e-6) return out;
    fail("is " + shown() + ", too short for a direction", "give a vector like [0, 0, 1]");
    return std::nullopt;
}

Vec3 Value::direction() const {
    return direction_in().value_or(Vec3::UnitZ());
}

std::size_t Value::element_count(std::size_t min_count, std::size_t max_count) const {
    const std::string remedy =
        "give an array of " +
        (min_count == max_count ? std::to_string(min_count)
                                : std::to_string(min_count) + " to " + std::to_string(max_count)) +
        " elements";
    if (!json_->is_array()) {
        fail("is " + shown_with_type(), remedy);
        return {};
    }
    if (json_->size() < min_count || json_->size() > max_count) {
        fail("has " + std::to_string(json_->size()) + " elements: " + shown(), remedy);
        if (json_->size() > max_count || min_count == max_count) return {};
    }
    return json_->size();
}

Value Value::element(std::size_t index) const {
    return {*source_, (*json_)[index], extended(path_, {"", static_cast<int>(index)})};
}

std::vector<Value> Value::elements(std::size_t min_count, std::size_t max_count) const {
    const std::size_t count = element_count(min_count, max_count);
    std::vector<Value> out;
    out.reserve(count);
    for (std::size_t i = 0; i < count; ++i) out.push_back(element(i));
    return out;
}

Object::Object(const Value& value, std::string_view kind)
    : value_(value), kind_(&keys_of(kind)), keys_(&kind_->keys) {
    const auto& json = value.json();
    if (!json.is_object()) {
        value.fail("is " + value.shown_with_type(), "give an object { } with " + list(*keys_));
        value_ = Value::make_void(value.source(), value.path());
        return;
    }
    for (const auto& item : json.items())
        if (std::find(keys_->begin(), keys_->end(), item.key()) == keys_->end()) note_unknown(item.key());
}

void Object::note_deprecated(const DeprecatedKey& key) {
    const Source& source = value_.source();
    const std::string old_name(key.old_name), name(key.name);
    const JsonPath path = extended(value_.path(), {old_name, -1});
    if (has(name)) {
        source.note(path, path, to_string(path) + " is the old name of '" + name + "', which is given too",
                    "remove '" + old_name + "'");
        return;
    }
    renamed_.emplace_back(key.name, old_name);
    const std::string note = to_string(path) + " is now called '" + name +
                             "'; the old name works until version " + std::string(key.removed_in);
    // One object may be read more than once.
    if (std::find(source.deprecations.begin(), source.deprecations.end(), note) == source.deprecations.end())
        source.deprecations.push_back(note);
}

void Object::note_unknown(const std::string& key) {
    for (const DeprecatedKey& old : kind_->deprecated)
        if (old.old_name == key) return note_deprecated(old);
    const Source& source = value_.source();
    const std::string near = nearest_word(key, {keys_->begin(), keys_->end()});
    const auto meant = std::find(keys_->begin(), keys_->end(), near);
    const JsonPath path = extended(value_.path(), {key, -1});
    Problem* noted =
        source.note(path, path, to_string(value_.path()) + " has the unknown key '" + printable(key) + "'",
                    near.empty() ? "known here: " + list(*keys_) : "did you mean '" + near + "'?",
                    near.empty() ? extended(value_.path(), {"", -1}) : path);
    if (near.empty()) {
        if (noted != nullptr) noted->unexplained = true;
        unknown_keys_.push_back(key);
    } else if (!has(near)) {
        renamed_.emplace_back(*meant, key);
    }
}

// Returns the key as written in the text for a known key.
std::string Object::written(std::string_view key) const {
    for (const auto& [known, as] : renamed_)
        if (known == key) return as;
    return std::string(key);
}

JsonPath Object::path_of(std::string_view key) const {
    return extended(value_.path(), {written(key), -1});
}

bool Object::has(std::string_view key) const {
    assert(key.empty() || std::find(keys_->begin(), keys_->end(), key) != keys_->end());
    return !key.empty() && value_.json().is_object() && value_.json().contains(written(key));
}

Value Object::at(std::string_view key) const {
    if (has(key)) return {value_.source(), value_.json().at(written(key)), path_of(key)};
    Value nothing = Value::make_void(value_.source(), path_of(key));
    if (key.empty() || value_.is_void()) return nothing;
    const Source& source = value_.source();
    if (source.problems.at(nothing.path()) != nullptr) return nothing;
    // An unknown key may be intended as the missing one: that is a single problem, though neither is assumed.
    for (const std::string& strange : unknown_keys_) {
        Problem* known = source.problems.at(extended(value_.path(), {strange, -1}));
        if (known == nullptr || !known->unexplained) continue;
        known->remedy = "'" + std::string(key) + "' is needed and missing; " + known->remedy;
        known->meant_for = nothing.path();
        known->unexplained = false;
        return nothing;
    }
    source.note(nothing.path(), value_.path(),
                to_string(value_.path()) + " has no '" + std::string(key) + "'", "add it, it is needed");
    return nothing;
}

std::optional<Value> Object::find(std::string_view key) const {
    if (!has(key)) return std::nullopt;
    Value value = at(key);
    if (value.json().is_null()) return std::nullopt;
    return value;
}

std::string_view Object::only_key() const {
    std::string_view only;
    std::size_t count = 0;
    for (const std::string_view key : *keys_)
        if (has(key)) {
            only = key;
            ++count;
        }
    if (count == 1) return only;
    // An unknown key that may be intended as the only one has been reported already.
    if (count > 1 || unknown_keys_.empty())
        value_.fail("has " + std::to_string(count) + " keys: " + value_.shown(),
                    "give exactly one of " + list(*keys_));
    return {};
}

bool Object::sound(std::initializer_list<std::string_view> keys) const {
    const Problems& problems = value_.source().problems;
    return !value_.is_void() && std::none_of(keys.begin(), keys.end(), [&](std::string_view key) {
        return problems.within(path_of(key));
    });
}

void Object::not_both(std::string_view first, std::string_view second) const {
    if (!find(first) || !find(second)) return;
    // Blames the key given on the command line, else the second.
    const bool blame_first = value_.source().override_of(at(first).path()) != nullptr;
    at(blame_first ? first : second)
        .fail(
            "is given beside '" + std::string(blame_first ? second : first) + "'",
            "take one of the two out (as an option: " + std::string(blame_first ? second : first) + "=null)");
}

void Object::read(std::string_view key, double& out, const Range& range) const {
    if (has(key)) out = at(key).number_in(range).value_or(out);
}
void Object::read(std::string_view key, int& out, int low, int high) const {
    if (has(key)) out = at(key).integer_in(low, high).value_or(out);
}
void Object::read(std::string_view key, bool& out) const {
    if (has(key)) out = at(key).truth().value_or(out);
}
void Object::read(std::string_view key, Vec3& out, const Range& range) const {
    if (has(key)) out = at(key).vector_in(range).value_or(out);
}
void Object::read_direction(std::string_view key, Vec3& out) const {
    if (has(key)) out = at(key).direction_in().value_or(out);
}
void Object::read_optional(std::string_view key, std::optional<double>& out, const Range& range) const {
    if (const auto value = find(key))
        if (const auto number = value->number_in(range)) out = number;
}

}  // namespace splitcubes::scene
