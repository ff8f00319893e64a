// Readers of what a motion is carried by and of the conditions on which things start and end.
#include <splitcubes/scene/motion.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/read_scene.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>

namespace splitcubes::scene {

namespace {

constexpr std::size_t longest_list = 200;  // bytes, of names in a message

template <class Named>
void append_names(std::span<const Named> things, std::string& out) {
    for (const Named& one : things)
        if (out.size() < longest_list) out += (out.empty() ? "" : ", ") + one.name;
}

template <class Named>
bool has_name(std::span<const Named> things, std::string_view name) {
    return std::any_of(things.begin(), things.end(), [&](const Named& one) { return one.name == name; });
}

// A thing whose invalid name was reported may be the one meant.
bool may_mean_unnamed(const Known& known) {
    return has_name(known.tools, "") || has_name(known.colliders, "") || has_name(known.bodies, "");
}

std::vector<CarrierKind> kinds_of(const Known& known, std::string_view name) {
    std::vector<CarrierKind> out;
    if (has_name(known.tools, name)) out.push_back(CarrierKind::tool);
    if (has_name(known.colliders, name)) out.push_back(CarrierKind::collider);
    if (has_name(known.bodies, name)) out.push_back(CarrierKind::body);
    return out;
}

void fail_unknown(const Value& value, const Known& known, const std::string& own_name) {
    if (!value.sound() || may_mean_unnamed(known)) return;
    if (value.text() == own_name)
        return value.fail("is " + value.shown() + ", the thing itself", "name what carries it");
    std::string names;
    append_names(known.tools, names);
    append_names(known.colliders, names);
    append_names(known.bodies, names);
    value.fail("is " + value.shown() + ", which names nothing that it can go along with",
               (known.only_before ? "tools and colliders must come before what goes along; there are "
                                  : "there are ") +
                   names);
}

// A name alone: of a thing of any kind.
std::optional<Carrier> read_carrier_name(const Value& value, const Known& known,
                                         const std::string& own_name) {
    Carrier out;
    out.name = value.text();
    const std::vector<CarrierKind> kinds = kinds_of(known, out.name);
    if (kinds.empty()) {
        fail_unknown(value, known, own_name);
        return std::nullopt;
    }
    out.kind = kinds.front();
    if (kinds.size() > 1)
        value.fail("is " + value.shown() + ", the name of several things",
                   "say which, as {\"" + std::string(carrier_names[static_cast<std::size_t>(out.kind)]) +
                       "\": \"" + out.name + "\"}");
    return out;
}

std::optional<Carrier> read_carrier_object(const Value& value, const Known& known,
                                           const std::string& own_name) {
    const Object object(value, "carrier");
    object.not_both("tool", "collider");
    object.not_both("tool", "body");
    object.not_both("collider", "body");
    Carrier out;
    std::optional<Value> name;
    for (std::size_t k = 0; k < carrier_names.size() && !name; ++k) {
        name = object.find(carrier_names[k]);
        out.kind = static_cast<CarrierKind>(k);
    }
    if (!name) {
        if (value.sound()) value.fail("names no tool, collider or body", "name one of the three");
        return std::nullopt;
    }
    out.name = name->text();
    if (const auto region = object.find("region")) {
        out.region = read_region(*region);
        if (out.kind != CarrierKind::body)
            region->fail("is given, but only bodies have regions", "take it out, or name a body");
    }
    const std::vector<CarrierKind> kinds = kinds_of(known, out.name);
    if (std::find(kinds.begin(), kinds.end(), out.kind) != kinds.end()) return out;
    fail_unknown(*name, known, own_name);
    return std::nullopt;
}

}  // namespace

std::optional<Carrier> read_carrier(const Object& object, const Known& known, const std::string& own_name) {
    const auto value = object.find("relative_to");
    if (!value) return std::nullopt;
    return value->json().is_string() ? read_carrier_name(*value, known, own_name)
                                     : read_carrier_object(*value, known, own_name);
}

std::optional<Condition> read_condition(const Object& object, std::string_view key,
                                        const std::vector<BodyDescription>& bodies) {
    const auto value = object.find(key);
    if (!value) return std::nullopt;
    const Object when(*value, "condition");
    Condition out;
    if (const auto body = when.find("body")) out.body = read_known_body(*body, bodies);
    when.read("at_least", out.at_least, 2, 1000000);
    if (const auto tool = when.find("ended")) out.ended = tool->text();
    when.read_optional("time", out.time, any_time);
    if (!when.sound({"body", "ended", "time"})) return out;
    if (!when.find("body") && !when.find("ended") && !when.find("time") && value->sound())
        value->fail("says nothing to wait for", "give body, ended or time");
    if (!when.find("body") && when.find("at_least"))
        when.at("at_least").fail("is given without a body", "name the body whose pieces count");
    return out;
}

void check_conditions(const Value& element, std::string_view kind,
                      std::initializer_list<std::string_view> keys, const Known& known) {
    const Object object(element, kind);
    for (const std::string_view key : keys) {
        const auto value = object.find(key);
        if (!value || !value->sound()) continue;
        const auto tool = Object(*value, "condition").find("ended");
        if (!tool || !tool->sound() || has_name(known.tools, tool->text()) || has_name(known.tools, ""))
            continue;
        std::string names;
        append_names(known.tools, names);
        tool->fail("is " + tool->shown() + ", but no tool has that name",
                   names.empty() ? "the scene has no tools" : "there are " + names);
    }
}

void check_waiting(const Object& scene, const std::vector<ToolDescription>& tools) {
    std::map<std::string_view, std::string_view> waits_for;
    for (const ToolDescription& tool : tools)
        if (tool.start_when && !tool.start_when->ended.empty()) waits_for[tool.name] = tool.start_when->ended;
    for (const ToolDescription& tool : tools) {
        std::string_view at = tool.name;
        for (std::size_t k = 0; k <= waits_for.size(); ++k) {
            const auto next = waits_for.find(at);
            if (next == waits_for.end()) break;
            at = next->second;
            if (at != tool.name) continue;
            return scene.at("tools").fail("has the tool \"" + tool.name + "\", which waits for its own end",
                                          "let one of the tools that wait for each other start by itself");
        }
    }
}

}  // namespace splitcubes::scene
