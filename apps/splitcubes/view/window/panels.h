// The viewer's panels: tools, material, run control, display, graphs, timeline.
#pragma once

#include <splitcubes/view/draw/state_renderer.h>
#include <splitcubes/view/parameters.h>
#include <splitcubes/view/step_history.h>
#include <splitcubes/view/viewer.h>

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::view {

/// Values that panels show beside the viewer's own.
struct PanelData {
    const StepHistory& history;
    const Latencies& latencies;
    const Legend& legend;
    std::optional<std::pair<std::int64_t, std::int64_t>> timeline;  // steps
    double frame_ms = 0;                                            // of the window
    double interface_ms = 0;                                        // of it, outside of OpenGL
    double seconds = 0;                                             // by the clock of the window
    const std::vector<NumberLabel>& labels;                         // over the picture
    std::string quality = {};                                       // of the pictures of what moves
    std::string film = {};                                          // that is made; empty: none
    bool is_recording = false;
    bool has_space_mouse = false;
};

/// The part of a framebuffer that panels leave to the picture; for the current ImGui context.
render::PixelArea picture_area(const Viewer& viewer, int width, int height);
/// Fills the rest of the framebuffer that is bound: ImGui would blend it.
void fill_behind_panels(const Viewer& viewer, int width, int height);

/// Draws within a frame of ImGui. What the user changes comes back as events, as recordings have them.
class Panels {
  public:
    void draw(const Viewer& viewer, const PanelData& data, std::vector<ViewerInput>& out);
    /// The help alone, over the gallery, if it is to be seen.
    void draw_help(const Viewer& viewer);
    /// Tells whether a panel was at a position in the last frame. ImGui's own answer is that of the frame's
    /// pointer, which may be elsewhere by now.
    bool covers(double x, double y) const;

  private:
    void tool_bar(const Viewer& viewer);
    void tool_settings(const Viewer& viewer);
    void materials(const Viewer& viewer);
    void display(const Viewer& viewer);
    void files(const Viewer& viewer, const PanelData& data);
    void numbers(const Viewer& viewer, const PanelData& data);
    void hint(const Viewer& viewer, const PanelData& data);
    void measures(const Viewer& viewer, const PanelData& data);
    void timeline(const Viewer& viewer, const PanelData& data);
    void run_control(const Viewer& viewer);
    void legend(const Legend& legend);
    void notice(const Viewer& viewer, double seconds);
    void help(const Viewer& viewer);
    void slider(const Viewer& viewer, const char* label, const char* setting, double low, double high,
                const char* format, bool logarithmic = false);
    void check(const Viewer& viewer, const char* label, const char* setting);
    void parameter(const Viewer& viewer, std::size_t index);
    void set(const std::string& name, double value);
    void act(const std::string& name, const std::string& text = {});

    void end_panel();

    std::vector<ViewerInput>* out_ = nullptr;
    std::vector<std::array<float, 4>> covered_;    // x, y, width, height
    std::array<float, parameter_count> edited_{};  // sliders that are held
    std::array<bool, parameter_count> is_edited_{};
    std::uint64_t notices_ = 0, own_notices_ = 0;
    double notice_since_ = -100;
    std::string notice_;
};

}  // namespace splitcubes::view
