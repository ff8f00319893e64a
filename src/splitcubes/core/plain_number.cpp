#include <splitcubes/core/plain_number.h>

#include <charconv>
#include <cmath>

namespace splitcubes {

namespace {
double rounded_to(double value, int digits) {
    char text[64];
    const auto written =
        std::to_chars(text, text + sizeof text, value, std::chars_format::scientific, digits - 1);
    std::from_chars(text, written.ptr, value);
    return value;
}
}  // namespace

std::string plain_number(double value, int digits) {
    if (digits > 0 && std::isfinite(value)) value = rounded_to(value, digits);
    value += 0.0;  // -0 becomes 0
    char text[64];
    const double size = std::abs(value);
    const bool fixed = size == 0 || (size >= 1e-6 && size < 1e15);
    const auto written = std::to_chars(text, text + sizeof text, value,
                                       fixed ? std::chars_format::fixed : std::chars_format::scientific);
    std::string out(text, written.ptr);
    // Shortens 1e-09 and 1e+18 to 1e-9 and 1e18.
    if (const std::size_t e = out.find('e'); e != std::string::npos) {
        std::size_t digit = e + 2;
        while (out[digit] == '0' && digit + 1 < out.size()) out.erase(digit, 1);
        if (out[e + 1] == '+') out.erase(e + 1, 1);
    }
    return out;
}

}  // namespace splitcubes
