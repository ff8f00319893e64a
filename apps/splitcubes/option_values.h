// Values of options: numbers and their ranges, parsed from text and formatted for messages.
#pragma once

#include <splitcubes/core/plain_number.h>

#include <string>
#include <string_view>

namespace splitcubes::app {

/// Numbers from `min` to `max`; `above`: excludes min.
struct Range {
    double min = 0, max = 0;
    bool above = false;
};
inline Range above(double min, double max) {
    return {min, max, true};
}

/// Returns "from 2 to 1024", "above 0 to 1000".
std::string range_text(const Range& range);

/// Both throw InputError with `where` as its location for text that is not a (whole) number and for numbers
/// out of range. Numbers are finite and parsed independently of the locale.
int read_integer(std::string_view text, const Range& range, const std::string& where);
double read_number(std::string_view text, const Range& range, const std::string& where);

}  // namespace splitcubes::app
