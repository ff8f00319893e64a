// Text of numbers for messages.
#pragma once

#include <string>

namespace splitcubes {

/// Returns a text like 100000000, 0.05 or 1e-12: without an exponent from 1e-6 to below 1e15, in any locale.
/// digits: significant digits, to which the number is rounded; 0: as many as restore the same number.
std::string plain_number(double value, int digits = 0);

}  // namespace splitcubes
