// The viewer's window, and its panels in pictures without one.
#pragma once

#include <splitcubes/view/draw/state_renderer.h>
#include <splitcubes/view/viewer.h>

#include <filesystem>
#include <functional>
#include <memory>

namespace splitcubes::view {

struct WindowSettings {
    std::filesystem::path file;          // to open; empty: none yet
    std::filesystem::path record_input;  // empty: input is not recorded
    std::filesystem::path screenshot;    // of the last frame; empty: none
    int width = 1280, height = 720;
    int frames = 0;  // after which it closes; 0: when the user does
    int threads = 0;
    std::function<bool()> is_interrupted = [] { return false; };  // asked before each frame
};

/// Returns the exit code. Throws JobError where no window can be had.
int run_window(const WindowSettings& settings);

/// Draws pictures with panels, in a context without a window.
class OffscreenPanels {
  public:
    virtual ~OffscreenPanels() = default;
    /// Takes a state into the graphs.
    virtual void observe(const PublishedState& state) = 0;
    virtual render::Picture picture(const Viewer& viewer, StateRenderer& renderer) = 0;
};
/// The context must be current, and outlive them. Of the gallery only pictures in the cache are shown.
std::unique_ptr<OffscreenPanels> make_offscreen_panels(const gl::Context& context);

}  // namespace splitcubes::view
