#include <splitcubes/core/plain_number.h>
#include <splitcubes/scene/plain_json.h>

#include <nlohmann/json.hpp>

namespace splitcubes::scene {

namespace {

// Stops once the text exceeds what a message shows.
void write_plainly(const nlohmann::ordered_json& json, std::string& out) {
    constexpr std::size_t enough = 200;
    if (json.is_number_float()) {
        out += plain_number(json.get<double>());
    } else if (!json.is_structured()) {
        out += json.dump();
    } else {
        const bool is_object = json.is_object();
        bool is_first = true;
        out += is_object ? '{' : '[';
        for (const auto& item : json.items()) {
            if (out.size() > enough) break;
            if (!is_first) out += ',';
            if (is_object) out += nlohmann::ordered_json(item.key()).dump() + ':';
            write_plainly(item.value(), out);
            is_first = false;
        }
        out += is_object ? '}' : ']';
    }
}

}  // namespace

std::string plain_json(const nlohmann::ordered_json& json) {
    std::string out;
    write_plainly(json, out);
    return out;
}

}  // namespace splitcubes::scene
