#include "command_line.h"
#include "commands.h"
#include "interrupts.h"
#include "option_values.h"
#include "output_targets.h"

#include <splitcubes/api/error.h>
#include <splitcubes/core/error.h>
#include <splitcubes/view/replay.h>
#include <splitcubes/view/simulation_loop.h>
#include <splitcubes/view/viewer.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#ifdef SPLITCUBES_WITH_RENDER
#include <splitcubes/render/image.h>
#include <splitcubes/view/draw/state_renderer.h>
#endif
#ifdef SPLITCUBES_WITH_VIEWER
#include <splitcubes/view/window/window.h>
#endif

namespace splitcubes::app {

namespace {

struct ViewOptions {
    std::string file, replay_input, record_input, screenshot;
    int frames = 0, steps_per_frame = 1, width = 1280, height = 720, threads = 0;
};

constexpr int max_picture = 8192;  // pixels along a side

#ifdef SPLITCUBES_WITH_RENDER

/// Pictures of a replay.
class Pictures {
  public:
    Pictures() {
        std::string why_not;
        context_ = gl::HeadlessContext::create(&why_not);
        if (!context_) throw JobError("no OpenGL for pictures: " + why_not);
        renderer_.emplace(*context_);
#ifdef SPLITCUBES_WITH_VIEWER
        panels_ = view::make_offscreen_panels();
#endif
    }
    void observe([[maybe_unused]] const view::Viewer& viewer) {
#ifdef SPLITCUBES_WITH_VIEWER
        panels_->observe(*viewer.state());
#endif
    }
    void save(const view::Viewer& viewer, const std::string& file) {
#ifdef SPLITCUBES_WITH_VIEWER
        const render::Picture picture = panels_->picture(viewer, *renderer_);
#else
        const render::Picture picture = renderer_->picture(viewer, static_cast<int>(viewer.size().width),
                                                           static_cast<int>(viewer.size().height));
#endif
        render::write_png(file, picture);
    }

  private:
    std::optional<gl::HeadlessContext> context_;
    std::optional<view::StateRenderer> renderer_;
#ifdef SPLITCUBES_WITH_VIEWER
    std::unique_ptr<view::OffscreenPanels> panels_;
#endif
};

#else

class Pictures {
  public:
    Pictures() { throw JobError("this program was built without OpenGL (SPLITCUBES_BUILD_RENDER)"); }
    void observe(const view::Viewer&) {}
    void save(const view::Viewer&, const std::string&) {}
};

#endif

int replay_inputs(const ViewOptions& options) {
    if (options.file.empty())
        throw InputError("view", "has nothing to replay the input on", "name a scene or a mesh");
    if (!options.screenshot.empty()) check_output_file(options.screenshot);
    view::ReplaySettings settings{
        .file = options.file,
        .inputs = view::read_inputs(options.replay_input),
        .frames = options.frames,
        .steps_per_frame = options.steps_per_frame,
        .size = {static_cast<double>(options.width), static_cast<double>(options.height)},
        .threads = options.threads};
    if (settings.frames == 0)
        settings.frames = settings.inputs.empty() ? 1 : settings.inputs.back().frame + 1;
    const auto asks_for_picture = [](const view::ViewerInput& input) { return input.name == "save_picture"; };
    std::unique_ptr<Pictures> pictures;
    if (!options.screenshot.empty() ||
        std::any_of(settings.inputs.begin(), settings.inputs.end(), asks_for_picture))
        pictures = std::make_unique<Pictures>();
    int frame = 0;
    const auto draw = [&](const view::Viewer& viewer, const std::string& picture) {
        ++frame;
        if (!pictures) return;
        pictures->observe(viewer);
        if (!picture.empty()) pictures->save(viewer, picture);
        if (frame == settings.frames && !options.screenshot.empty())
            pictures->save(viewer, options.screenshot);
    };
    const view::ReplayResult result = view::replay_input(settings, draw);
    std::printf("step %lld, %.6g s, %zu pieces, state %016llx\n", static_cast<long long>(result.step),
                result.time, result.pieces, static_cast<unsigned long long>(result.state_hash));
    if (!result.notice.empty()) std::cout << result.notice << '\n';
    return 0;
}

int open_window([[maybe_unused]] const ViewOptions& options) {
#ifdef SPLITCUBES_WITH_VIEWER
    view::WindowSettings settings;
    settings.file = options.file;
    settings.record_input = options.record_input;
    settings.width = options.width;
    settings.height = options.height;
    settings.threads = options.threads;
    settings.frames = options.frames;
    settings.screenshot = options.screenshot;
    settings.is_interrupted = interrupted;
    return view::run_window(settings);
#else
    throw JobError(
        "this program was built without its viewer: install libglfw3-dev and libimgui-dev, then "
        "configure with SPLITCUBES_BUILD_VIEWER=ON");
#endif
}

int run_view(const ViewOptions& options) {
    try {
        return options.replay_input.empty() ? open_window(options) : replay_inputs(options);
    } catch (const Error& error) {
        if (error.kind() == ErrorKind::failed || error.kind() == ErrorKind::broken)
            throw JobError(error.what());
        throw InputError(error.what(), "cannot be shown");
    }
}

}  // namespace

void add_view_command(CommandLine& line) {
    const auto options = std::make_shared<ViewOptions>();
    Command& command = line.add("view", "Cuts and pulls a scene or a mesh by hand, in a window");
    command
        .add_text("FILE", "", options->file,
                  "Scene, mesh, recording or saved simulation; or drop one on the window")
        .completes(files());
    command.add_text("--record-input", "FILE", options->record_input,
                     "Writes all input of the window, an event a line");
    command
        .add_text("--replay-input", "FILE", options->replay_input,
                  "Takes input from a file in place of a window; prints the state that it ends in")
        .completes(files());
    command.add_integer("--frames", "N", options->frames, {1, 1000000},
                        "Ends after N frames; default of a replay: its last event");
    command.add_integer("--steps-per-frame", "N", options->steps_per_frame, {1, 1000},
                        "Time steps of a frame in a replay (1)");
    command.add_text("--screenshot", "FILE.png", options->screenshot, "Picture of the last frame");
    const Range pixels{64, max_picture};
    command.add_integer("--width", "N", options->width, pixels, "Pixels (1280)");
    command.add_integer("--height", "N", options->height, pixels, "Pixels (720)");
    command.add_threads(options->threads);
    command.example("splitcubes view scenes/meshes/liver.obj");
    command.run = [options] { return run_view(*options); };
}

}  // namespace splitcubes::app
