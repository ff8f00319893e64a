// Available memory, for work that needs much of it.
#pragma once

#include <string>

namespace splitcubes {

/// Returns the bytes that the process can still allocate: the minimum of what the machine has free and of
/// what limits on the process and its control groups leave; infinity if none of them is known.
double available_memory();

/// Throws InputError where about `needed` bytes are more than there are: says both and the remedy. To be
/// Throws InputError if about `needed` bytes exceed `available`; the message contains both and the remedy.
/// Call it before the work begins: on a system that overcommits memory an allocation never fails, and the
/// system kills the process instead.
void require_memory(const std::string& where, double needed, const std::string& remedy,
                    double available = available_memory());

/// Returns a text like "3.4 GB".
std::string bytes_text(double bytes);

}  // namespace splitcubes
