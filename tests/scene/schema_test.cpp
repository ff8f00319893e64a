// The parser and scenes/schema.json must agree.
#include <splitcubes/core/error.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/resolve.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <scene/full_scene.h>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>

namespace splitcubes::scene {
namespace {

using Json = nlohmann::ordered_json;
using testing::HasSubstr;
using Pointer = Json::json_pointer;

const Json& schema() {
    static const Json json = [] {
        std::ifstream file(SPLITCUBES_SCENES "/schema.json");
        return Json::parse(file);
    }();
    return json;
}

// A property of an object in a scene.
struct Property {
    std::string object;  // kind, as in scene_keys
    std::string key;
    Json rule;        // of the schema, with its $ref resolved
    Json reference;   // the same, unresolved: has the default
    Pointer pointer;  // to the property's value in the scene
};

Json followed(const Json& rule, std::string& kind) {
    if (rule.contains("anyOf")) return followed(rule["anyOf"][0], kind);
    if (!rule.contains("$ref")) return rule;
    const std::string prefix = "#/$defs/";
    kind = rule["$ref"].get<std::string>().substr(prefix.size());
    return schema()["$defs"][kind];
}

// Calls `visit` for every value, outer before inner. Elements of arrays are properties too, with the array's
// key.
void walk(const Json& value, const Json& rule, const std::string& kind, const Pointer& at,
          const std::function<void(const Property&)>& visit) {
    if (value.is_object()) {
        for (const auto& item : value.items()) {
            const Json& reference = rule.at("properties").at(item.key());
            std::string inner_kind;
            const Json inner = followed(reference, inner_kind);
            visit({kind, item.key(), inner, reference, at / item.key()});
            walk(item.value(), inner, inner_kind, at / item.key(), visit);
        }
    } else if (value.is_array()) {
        for (std::size_t i = 0; i < value.size(); ++i) {
            std::string inner_kind;
            const Json inner = followed(rule.at("items"), inner_kind);
            if (!value[i].is_object()) visit({kind, at.back(), inner, rule.at("items"), at / i});
            walk(value[i], inner, inner_kind, at / i, visit);
        }
    }
}

std::vector<Json> full_scenes() {
    const Json with_frames = Json::parse(full_scene);
    Json with_duration = with_frames;
    with_duration.erase("frames");
    with_duration["duration"] = 0.5;
    return {with_frames, with_duration};
}

void for_each_property(const std::function<void(const Json&, const Property&)>& visit) {
    for (const Json& scene : full_scenes()) {
        walk(scene, schema(), "scene", Pointer(), [&](const Property& p) { visit(scene, p); });
    }
}

SceneDescription parse_json(const Json& json) {
    return parse_scene_text(json.dump(1), "x.json", SPLITCUBES_SCENES);
}

std::string schema_error_of(const Json& json) {
    try {
        parse_json(json);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

Json changed(Json scene, const Pointer& at, const Json& value) {
    scene[at] = value;
    return scene;
}

Json without(Json scene, const Property& property) {
    scene[property.pointer.parent_pointer()].erase(property.key);
    return scene;
}

bool is_object_property(const Json& scene, const Property& p) {
    return scene[p.pointer.parent_pointer()].is_object();
}

TEST(Schema, has_the_keys_of_the_parser) {
    std::set<std::string> objects;
    for (const ObjectKeys& kind : scene_keys()) {
        const std::string name(kind.object);
        objects.insert(name);
        const Json& object = name == "scene" ? schema() : schema()["$defs"].at(name);
        std::set<std::string> in_schema;
        for (const auto& item : object.at("properties").items()) in_schema.insert(item.key());
        EXPECT_EQ(in_schema, std::set<std::string>(kind.keys.begin(), kind.keys.end())) << name;
        EXPECT_EQ(object.at("additionalProperties"), false) << name;
        for (const auto& item : object.at("properties").items()) {
            EXPECT_TRUE(item.value().contains("description") || item.value().contains("$ref")) << item.key();
        }
    }
    for (const auto& item : schema()["$defs"].items()) {
        EXPECT_EQ(objects.count(item.key()), item.value().contains("properties") ? 1u : 0u) << item.key();
    }
}

TEST(Schema, path_files_have_the_keys_of_the_parser) {
    std::ifstream file(SPLITCUBES_SCENES "/paths/schema.json");
    const Json json = Json::parse(file);
    std::set<std::string> in_schema;
    for (const auto& item : json.at("properties").items()) in_schema.insert(item.key());
    ASSERT_EQ(path_keys().size(), 1u);
    const auto& keys = path_keys()[0].keys;
    EXPECT_EQ(in_schema, std::set<std::string>(keys.begin(), keys.end()));
    EXPECT_EQ(json.at("additionalProperties"), false);
    EXPECT_EQ(json.at("required"), Json::array({"tools"}));
    EXPECT_EQ(json.at("properties").at("tools").at("items").at("$ref"), "../schema.json#/$defs/tool");
    EXPECT_EQ(json.at("properties").at("tools").at("maxItems"), ParseLimits::tools);
}

TEST(Schema, all_of_it_is_in_the_full_scenes) {
    std::set<std::string> seen;
    for_each_property([&](const Json& scene, const Property& p) {
        if (is_object_property(scene, p)) seen.insert(p.object + "." + p.key);
    });
    for (const ObjectKeys& kind : scene_keys()) {
        for (const auto key : kind.keys) {
            EXPECT_EQ(seen.count(std::string(kind.object) + "." + std::string(key)), 1u)
                << kind.object << "." << key;
        }
    }
    for (const Json& scene : full_scenes()) EXPECT_EQ(schema_error_of(scene), "");
}

// A value just outside each bound is refused; the bound itself, if included, is not refused because of its
// value.
TEST(Schema, bounds_are_the_bounds_of_the_parser) {
    std::size_t bounds = 0;
    const auto check = [&](const Json& scene, const Property& p, const std::string& bound, double outwards,
                           bool open) {
        if (!p.rule.contains(bound)) return;
        ++bounds;
        const Json limit = p.rule[bound];
        const double beyond = outwards * std::max(1.0, 1e-9 * std::abs(limit.get<double>()));
        const Json outside = Json(std::nextafter(limit.get<double>(), outwards * 1e300));
        const Json farther = Json(limit.get<double>() + beyond);
        for (const Json& bad : {outside, farther, open ? limit : farther}) {
            EXPECT_NE(schema_error_of(changed(scene, p.pointer, bad)), "") << p.pointer << " " << bad;
        }
        const std::string on_it = schema_error_of(changed(scene, p.pointer, limit));
        EXPECT_EQ(on_it.find("out of range") != std::string::npos, open) << p.pointer << " " << on_it;
    };
    for_each_property([&](const Json& scene, const Property& p) {
        check(scene, p, "minimum", -1, false);
        check(scene, p, "maximum", 1, false);
        check(scene, p, "exclusiveMinimum", -1, true);
        check(scene, p, "exclusiveMaximum", 1, true);
    });
    EXPECT_GT(bounds, 300u);
}

TEST(Schema, every_number_has_bounds) {
    for_each_property([&](const Json&, const Property& p) {
        const Json type = p.rule.value("type", Json());
        const Json main_type = type.is_array() ? type[0] : type;
        if (main_type != "number" && main_type != "integer") return;
        EXPECT_TRUE(p.rule.contains("minimum") || p.rule.contains("exclusiveMinimum")) << p.pointer;
        EXPECT_TRUE(p.rule.contains("maximum") || p.rule.contains("exclusiveMaximum")) << p.pointer;
    });
}

TEST(Schema, wrong_types_are_refused_and_named) {
    std::size_t count = 0;
    for_each_property([&](const Json& scene, const Property& p) {
        const Json& good = scene[p.pointer];
        for (const Json& wrong :
             {Json("no such thing"), Json(0.123), Json(true), Json::array({1, 2, 3, 4}), Json{{"zzz", 1}}}) {
            if (wrong.type() == good.type() || (wrong.is_number() && good.is_number())) continue;
            const std::string error = schema_error_of(changed(scene, p.pointer, wrong));
            EXPECT_THAT(error, HasSubstr("x.json:")) << p.pointer << " " << wrong;
            EXPECT_THAT(error, HasSubstr(p.key)) << p.pointer << " " << wrong;
            ++count;
        }
        if (p.rule.contains("enum") && good.is_string()) {
            EXPECT_THAT(schema_error_of(changed(scene, p.pointer, "zzz")),
                        HasSubstr("\"zzz\", which is unknown"));
        }
    });
    EXPECT_GT(count, 500u);
}

TEST(Schema, unknown_keys_are_refused_in_every_object) {
    for_each_property([&](const Json& scene, const Property& p) {
        if (!scene[p.pointer].is_object()) return;
        const std::string error = schema_error_of(changed(scene, p.pointer / "zzzzzz", 1));
        EXPECT_THAT(error, HasSubstr("unknown key 'zzzzzz'")) << p.pointer;
        // The key is added last: its line is one above the closing brace.
        const std::string text = changed(scene, p.pointer / "zzzzzz", 1).dump(1);
        const auto line =
            std::count(text.begin(), text.begin() + static_cast<long>(text.find("zzzzzz")), '\n') + 1;
        EXPECT_THAT(error, HasSubstr("x.json:" + std::to_string(line) + ": ")) << p.pointer;
    });
}

TEST(Schema, required_keys_are_those_of_the_parser) {
    // Required only in combination with other keys of the full scenes.
    const std::set<std::string> conditional = {
        "constraint.keyframes", "camera.eye",     "camera.target",   "collider.shape",
        "collider.half_space",  "scene.tools",    "tool.instrument", "carrier.tool",
        "carrier.collider",     "carrier.body",   "condition.body",  "condition.ended",
        "condition.time",       "scene.colliders"};
    for_each_property([&](const Json& scene, const Property& p) {
        if (!is_object_property(scene, p) || conditional.count(p.object + "." + p.key) > 0) return;
        const Json& object = p.object == "scene" ? schema() : schema()["$defs"][p.object];
        const Json required = object.value("required", Json::array());
        const bool needed = std::find(required.begin(), required.end(), p.key) != required.end();
        const std::string error = schema_error_of(without(scene, p));
        if (object.contains("minProperties")) {
            EXPECT_THAT(error, HasSubstr("exactly one of")) << p.pointer;
        } else if (needed) {
            EXPECT_THAT(error, HasSubstr("has no '" + p.key + "'")) << p.pointer;
        } else {
            EXPECT_EQ(error, "") << p.pointer;
        }
    });
}

TEST(Schema, defaults_are_those_of_the_parser) {
    Json bare = Json::parse(full_scene);
    std::vector<Property> erased;
    for_each_property([&](const Json& scene, const Property& p) {
        const bool lists = p.object == "scene" && (p.key == "constraints" || p.key == "tools");
        if (!is_object_property(scene, p) || !p.reference.contains("default") || lists) return;
        // The resolved scene has copies and motions in place of what says how to make them.
        for (Pointer at = p.pointer; !at.empty(); at = at.parent_pointer())
            if (scene[at].is_object() &&
                (scene[at].contains("repeat") || scene[at].value("relative_to", Json()).is_string()))
                return;
        const Pointer parent = p.pointer.parent_pointer();
        // Its parent may have been erased already.
        if (!bare.contains(parent)) return;
        if (bare[parent].erase(p.key) > 0) erased.push_back(p);
    });
    const Json resolved = resolved_scene(parse_json(bare));
    EXPECT_GT(erased.size(), 50u);
    for (const Property& p : erased) {
        ASSERT_TRUE(resolved.contains(p.pointer)) << p.pointer;
        EXPECT_EQ(resolved[p.pointer], p.reference["default"]) << p.pointer;
    }
}

}  // namespace
}  // namespace splitcubes::scene
