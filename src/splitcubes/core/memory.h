// How much memory there is for work that will take much of it.
#pragma once

#include <string>

namespace splitcubes {

/// Bytes that the process can still take: the least of what the machine has to spare and of what limits on
/// the process and on its control groups leave; infinity where nothing is known of any of them.
double available_memory();

/// Throws InputError where about `needed` bytes are more than there are: says both and the remedy. To be
/// asked before the work begins: where memory is promised freely, taking it never fails, and the system ends
/// the process instead.
void require_memory(const std::string& where, double needed, const std::string& remedy,
                    double available = available_memory());

/// "3.4 GB".
std::string bytes_text(double bytes);

}  // namespace splitcubes
