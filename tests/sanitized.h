#pragma once

// Whether the tests run with address or thread sanitizer, whose own tables count as
// memory of the process: limits of memory cannot be set there.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SPLITCUBES_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SPLITCUBES_SANITIZED 1
#endif
#endif

#ifdef SPLITCUBES_SANITIZED
constexpr bool memory_can_be_limited = false;
#else
constexpr bool memory_can_be_limited = true;
#endif
