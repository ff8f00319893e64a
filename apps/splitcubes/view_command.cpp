#include "command_line.h"
#include "commands.h"
#include "interrupts.h"
#include "option_values.h"
#include "output_targets.h"

#include <splitcubes/api/error.h>
#include <splitcubes/core/error.h>
#include <splitcubes/view/replay.h>
#include <splitcubes/view/simulation_loop.h>
#include <splitcubes/view/timeline.h>
#include <splitcubes/view/viewer.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#ifdef SPLITCUBES_WITH_RENDER
#include <splitcubes/render/image.h>
#include <splitcubes/render/video.h>
#include <splitcubes/view/draw/film_maker.h>
#include <splitcubes/view/draw/state_renderer.h>
#endif
#ifdef SPLITCUBES_WITH_VIEWER
#include <splitcubes/view/window/window.h>
#endif

namespace splitcubes::app {

namespace {

struct ViewOptions {
    std::string file, replay_input, record_input, screenshot, film;
    int frames = 0, steps_per_frame = 1, width = 1280, height = 720, threads = 0;
};

constexpr int max_picture = 8192;  // pixels along a side

#ifdef SPLITCUBES_WITH_RENDER

/// Pictures of a replay.
class Pictures {
  public:
    Pictures() {
        renderer_.emplace(*context_);
#ifdef SPLITCUBES_WITH_VIEWER
        panels_ = view::make_offscreen_panels(*context_);
#endif
    }
    void film_all(const std::string& file, const ViewOptions& options) {
        all_.emplace(file, render::VideoOptions{.width = options.width & ~1,
                                                .height = options.height & ~1,
                                                .frames_per_second = view::film_rate});
    }
    void take(const view::ReplayFrame& frame, const std::string& screenshot) {
        using view::WindowAct;
        view::Viewer& viewer = frame.viewer;
        film_.observe(viewer);
#ifdef SPLITCUBES_WITH_VIEWER
        if (!viewer.state()->bodies.empty()) panels_->observe(*viewer.state());
#endif
        for (const auto& [act, text] : frame.acts) {
            if (act == WindowAct::save_picture) save(viewer, text.empty() ? "splitcubes.png" : text);
            if (act == WindowAct::save_film) make_film(frame, text);
            if (act == WindowAct::record_film) record_film(viewer, text);
        }
        if (!screenshot.empty()) save(viewer, screenshot);
        if (all_) all_->add(picture(viewer, 2));
    }
    void finish() {
        if (film_.is_recording()) std::cout << film_.stop() << '\n';
        if (all_) all_->finish();
    }

  private:
    // The size is even where a film needs it.
    render::Picture picture(const view::Viewer& viewer, int multiple) {
#ifdef SPLITCUBES_WITH_VIEWER
        render::Picture whole = panels_->picture(viewer, *renderer_);
#else
        render::Picture whole = renderer_->picture(viewer, static_cast<int>(viewer.size().width),
                                                   static_cast<int>(viewer.size().height));
#endif
        const int width = whole.width / multiple * multiple, height = whole.height / multiple * multiple;
        if (width == whole.width && height == whole.height) return whole;
        render::Picture out{.width = width, .height = height, .rgb = {}};
        for (int row = 0; row < height; ++row)
            out.rgb.insert(out.rgb.end(), whole.pixel(0, row), whole.pixel(0, row) + 3 * width);
        return out;
    }
    void save(const view::Viewer& viewer, const std::string& file) {
        render::write_png(file, picture(viewer, 1));
    }
    void make_film(const view::ReplayFrame& frame, const std::string& file) {
        std::string line = film_.make(file.empty() ? "splitcubes-film.mp4" : file, frame.timeline.states(),
                                      frame.viewer, static_cast<int>(frame.viewer.size().width),
                                      static_cast<int>(frame.viewer.size().height));
        while (film_.is_making()) line = film_.advance();
        frame.viewer.notify(line);
        std::cout << line << '\n';
    }
    void record_film(view::Viewer& viewer, const std::string& file) {
        std::string line;
        if (film_.is_recording())
            std::cout << (line = film_.stop()) << '\n';
        else
            line =
                film_.record(file.empty() ? "splitcubes-film.mp4" : file, viewer,
                             static_cast<int>(viewer.size().width), static_cast<int>(viewer.size().height));
        if (!line.empty()) viewer.notify(line);
    }

    static std::optional<gl::HeadlessContext> started() {
        std::string why_not;
        std::optional<gl::HeadlessContext> out = gl::HeadlessContext::create(&why_not);
        if (!out) throw JobError("no OpenGL for pictures: " + why_not);
        return out;
    }

    std::optional<gl::HeadlessContext> context_ = started();
    std::optional<view::StateRenderer> renderer_;
    view::FilmMaker film_{*context_};
    std::optional<render::VideoWriter> all_;
#ifdef SPLITCUBES_WITH_VIEWER
    std::unique_ptr<view::OffscreenPanels> panels_;
#endif
};

#else

class Pictures {
  public:
    Pictures() { throw JobError("this program was built without OpenGL (SPLITCUBES_BUILD_RENDER)"); }
    void film_all(const std::string&, const ViewOptions&) {}
    void take(const view::ReplayFrame&, const std::string&) {}
    void finish() {}
};

#endif

int replay_inputs(const ViewOptions& options) {
    for (const std::string& file : {options.screenshot, options.film})
        if (!file.empty()) check_output_file(file);
    view::ReplaySettings settings{
        .file = options.file,
        .inputs = view::read_inputs(options.replay_input),
        .frames = options.frames,
        .steps_per_frame = options.steps_per_frame,
        .size = {static_cast<double>(options.width), static_cast<double>(options.height)},
        .threads = options.threads};
    if (settings.frames == 0)
        settings.frames = settings.inputs.empty() ? 1 : settings.inputs.back().frame + 1;
    const auto asks_for_picture = [](const view::ViewerInput& input) {
        return input.name == "save_picture" || input.name == "f12" || input.name == "save_film" ||
               input.name == "record_film" || input.name == "f11";
    };
    std::unique_ptr<Pictures> pictures;
    if (!options.screenshot.empty() || !options.film.empty() ||
        std::any_of(settings.inputs.begin(), settings.inputs.end(), asks_for_picture))
        pictures = std::make_unique<Pictures>();
    if (!options.film.empty()) pictures->film_all(options.film, options);
    const view::ReplayResult result = view::replay_input(settings, [&](const view::ReplayFrame& frame) {
        if (!pictures) return;
        pictures->take(frame, frame.number + 1 == settings.frames ? options.screenshot : std::string());
    });
    if (pictures) pictures->finish();
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
                  "Scene, mesh, run, recording or saved simulation; or drop one on the window. Without it: a "
                  "gallery")
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
    command.add_text("--film", "FILE.mp4", options->film,
                     "Film of a replay with its panels and pointer, a picture a frame, 30 a second");
    command.add_text("--screenshot", "FILE.png", options->screenshot, "Picture of the last frame");
    const Range pixels{64, max_picture};
    command.add_integer("--width", "N", options->width, pixels, "Pixels (1280)");
    command.add_integer("--height", "N", options->height, pixels, "Pixels (720)");
    command.add_threads(options->threads);
    command.example("splitcubes view scenes/meshes/liver.obj");
    command.run = [options] { return run_view(*options); };
}

}  // namespace splitcubes::app
