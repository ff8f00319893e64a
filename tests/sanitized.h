#pragma once

#include <splitcubes/core/sanitizers.h>

/// Programs start ten times as slowly then, and the sanitizer's own tables count as memory of the process:
/// no limit of memory can be set.
#if defined(SPLITCUBES_ADDRESS_SANITIZER) || defined(SPLITCUBES_THREAD_SANITIZER)
constexpr bool is_sanitized = true;
#else
constexpr bool is_sanitized = false;
#endif
