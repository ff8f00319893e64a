#include "command_line.h"
#include "commands.h"
#include "opengl_backend.h"

#include <splitcubes/core/parallel.h>

#ifdef SPLITCUBES_WITH_RENDER
#include <splitcubes/gl/context.h>
#endif

#include <iostream>

namespace splitcubes::app {

namespace {

std::string simd() {
#if defined(__x86_64__)
    std::string out;
    if (__builtin_cpu_supports("avx512f")) out += "AVX-512 ";
    if (__builtin_cpu_supports("avx2")) out += "AVX2 ";
    return out + "SSE2";
#else
    return "portable";
#endif
}

// Returns whether runs can use occlusion.backend "opengl".
std::string opengl_start() {
#ifdef SPLITCUBES_WITH_RENDER
    try {
        const auto make = opengl_backend_maker(true);
        make({});
        return "starts";
    } catch (const std::exception& error) {
        return std::string("does not start (") + error.what() + ")";
    }
#else
    return "does not start (not built in)";
#endif
}

int info() {
    std::cout << "splitcubes " << SPLITCUBES_VERSION << '\n'
              << "build       " << SPLITCUBES_BUILD_TYPE << ", "
              <<
#if defined(__clang__)
        "clang " << __clang_major__ << '.' << __clang_minor__ << '\n'
#else
        "gcc " << __GNUC__ << '.' << __GNUC_MINOR__ << '\n'
#endif
              << "threads     " << Parallel().thread_count() << '\n'
              << "SIMD        " << simd() << '\n'
#ifdef SPLITCUBES_WITH_RENDER
              << "OpenGL      " << gl::opengl_summary() << '\n'
#else
              << "OpenGL      not built in\n"
#endif
              << "occlusion   cpu starts, opengl " << opengl_start() << '\n';
    return 0;
}

}  // namespace

void add_info_command(CommandLine& line) {
    Command& command =
        line.add("info", "Version, build, threads, SIMD, OpenGL, and which occlusion backends start");
    command.run = info;
}

}  // namespace splitcubes::app
