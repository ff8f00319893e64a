#include <splitcubes/core/error.h>
#include <splitcubes/scene/json_path.h>

#include <charconv>
#include <system_error>

namespace splitcubes::scene {

bool is_path_word(char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' ||
           c == '$' || c == '-';
}

std::string to_string(const JsonPath& path) {
    if (path.empty()) return "the scene";
    std::string out;
    for (const PathStep& step : path) {
        if (step.index >= 0) {
            out += "[" + std::to_string(step.index) + "]";
        } else {
            if (!out.empty()) out += ".";
            out += printable(step.key);
        }
    }
    return out;
}

JsonPath parse_path(std::string_view text, const std::string& where) {
    const std::string remedy = "write it like bodies[0].material.density";
    const std::string shown = "'" + printable(std::string(text)) + "'";
    JsonPath path;
    std::size_t at = 0;
    while (at < text.size()) {
        if (text[at] == '[' && at > 0) {
            int index = -1;
            const char* start = text.data() + at + 1;
            const auto [end, error] = std::from_chars(start, text.data() + text.size(), index);
            if (error != std::errc{} || index < 0 || end == text.data() + text.size() || *end != ']') {
                throw InputError(where, "path " + shown + " has no number between [ and ]", remedy);
            }
            path.push_back({"", index});
            at = static_cast<std::size_t>(end - text.data()) + 1;
            continue;
        }
        if (!path.empty() && text[at] == '.') ++at;
        std::size_t end = at;
        while (end < text.size() && is_path_word(text[end])) ++end;
        const bool joined = !path.empty() && (at == 0 || text[at - 1] != '.');
        if (end == at || joined)
            throw InputError(
                where,
                "path " + shown + " has no key at '" + printable(std::string(text.substr(at, 10))) + "'",
                remedy);
        path.push_back({std::string(text.substr(at, end - at)), -1});
        at = end;
    }
    if (path.empty()) throw InputError(where, "the path is empty", remedy);
    return path;
}

bool is_within(const JsonPath& inner, const JsonPath& outer) {
    if (inner.size() < outer.size()) return false;
    for (std::size_t i = 0; i < outer.size(); ++i) {
        if (!(inner[i] == outer[i])) return false;
    }
    return true;
}

}  // namespace splitcubes::scene
