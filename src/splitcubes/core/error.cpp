#include <splitcubes/core/error.h>

namespace splitcubes {

namespace {
std::string compose(const std::string& location, const std::string& problem, const std::string& remedy) {
    std::string line = location + ": " + problem;
    if (!remedy.empty()) line += "; " + remedy;
    return printable(line, 2000);
}
}  // namespace

InputError::InputError(const std::string& location, const std::string& problem, const std::string& remedy)
    : std::runtime_error(compose(location, problem, remedy)) {}

std::string printable(const std::string& text, std::size_t limit) {
    std::string out;
    for (const char c : text) {
        if (out.size() >= limit) {
            out += "...";
            break;
        }
        const auto byte = static_cast<unsigned char>(c);
        out += (byte < 0x20 || byte == 0x7f) ? '?' : c;
    }
    return out;
}

}  // namespace splitcubes
