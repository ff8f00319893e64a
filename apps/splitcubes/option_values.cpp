#include "option_values.h"

#include <splitcubes/core/error.h>

#include <charconv>
#include <cmath>
#include <cstdint>
#include <system_error>

namespace splitcubes::app {

namespace {

// std::from_chars accepts no leading plus.
std::string_view without_plus(std::string_view text) {
    if (text.size() > 1 && text[0] == '+' && text[1] != '-' && text[1] != '+') text.remove_prefix(1);
    return text;
}

std::string quoted(std::string_view text) {
    return "'" + printable(std::string(text)) + "'";
}

// A parsed number; text of a number that is too large or too small for its type is out of range.
struct Parsed {
    bool is_number = false;
    bool fits = false;
};

template <typename T>
Parsed parse(std::string_view text, T& value) {
    const std::string_view digits = without_plus(text);
    const char* const end = digits.data() + digits.size();
    const auto [stop, error] = std::from_chars(digits.data(), end, value);
    if (stop != end || error == std::errc::invalid_argument) return {};
    return {true, error == std::errc()};
}

[[noreturn]] void fail_range(std::string_view shown, const Range& range, const char* kind,
                             const std::string& where) {
    throw InputError(where, printable(std::string(shown)) + " is out of range",
                     std::string("give ") + kind + " " + range_text(range));
}

}  // namespace

std::string range_text(const Range& range) {
    return (range.above ? "above " : "from ") + plain_number(range.min) + " to " + plain_number(range.max);
}

int read_integer(std::string_view text, const Range& range, const std::string& where) {
    std::int64_t value = 0;
    const Parsed parsed = parse(text, value);
    if (!parsed.is_number)
        throw InputError(where, quoted(text) + " is not a whole number", "give one " + range_text(range));
    const auto number = static_cast<double>(value);
    if (!parsed.fits || number < range.min || number > range.max)
        fail_range(text, range, "a whole number", where);
    return static_cast<int>(value);
}

double read_number(std::string_view text, const Range& range, const std::string& where) {
    double value = 0;
    const Parsed parsed = parse(text, value);
    if (!parsed.is_number || (parsed.fits && !std::isfinite(value)))
        throw InputError(where, quoted(text) + " is not a number", "give one " + range_text(range));
    if (!parsed.fits || value < range.min || value > range.max || (range.above && value == range.min))
        fail_range(text, range, "a number", where);
    return value;
}

}  // namespace splitcubes::app
