// Numbers as people write them, for messages.
#pragma once

#include <string>

namespace splitcubes {

/// 100000000, 0.05, 1e-12: without an exponent from 1e-6 to below 1e15, whatever the locale. digits:
/// significant ones, to which it is rounded; 0: as many as give the same number back.
std::string plain_number(double value, int digits = 0);

}  // namespace splitcubes
