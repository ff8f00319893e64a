#include "drawing_threads.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <string>
#include <string_view>
#include <thread>

#include <sys/resource.h>

namespace splitcubes::view {

namespace {

constexpr int nice_of_drawing = 5;  // a third of the share of a thread that simulates

bool draws_in_software() {
    const auto* text = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    const std::string_view name = text != nullptr ? text : "";
    constexpr std::array<std::string_view, 3> rasterisers = {"llvmpipe", "softpipe", "swrast"};
    return std::any_of(rasterisers.begin(), rasterisers.end(),
                       [&](std::string_view one) { return name.find(one) != std::string_view::npos; });
}

}  // namespace

DrawingThreads::DrawingThreads() : in_software_(draws_in_software()) {
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task", ignored)) {
        const std::string name = entry.path().filename();
        int id = 0;
        std::from_chars(name.data(), name.data() + name.size(), id);
        if (id > 0) threads_.push_back(id);
    }
}

int DrawingThreads::threads_left(int wished) const {
    if (wished > 0 || !in_software_) return wished;
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()) - 1);
}

void DrawingThreads::give_way() const {
    if (!in_software_) return;
    for (const int id : threads_) setpriority(PRIO_PROCESS, static_cast<id_t>(id), nice_of_drawing);
}

}  // namespace splitcubes::view
