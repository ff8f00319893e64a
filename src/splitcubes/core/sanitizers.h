// Macros for the sanitizer that the code is compiled with; gcc and clang announce it differently.
#pragma once

#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define SPLITCUBES_THREAD_SANITIZER 1
#endif
#if __has_feature(address_sanitizer)
#define SPLITCUBES_ADDRESS_SANITIZER 1
#endif
#endif

#if defined(__SANITIZE_THREAD__) && !defined(SPLITCUBES_THREAD_SANITIZER)
#define SPLITCUBES_THREAD_SANITIZER 1
#endif
#if defined(__SANITIZE_ADDRESS__) && !defined(SPLITCUBES_ADDRESS_SANITIZER)
#define SPLITCUBES_ADDRESS_SANITIZER 1
#endif
