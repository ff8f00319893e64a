#include "commands.h"

#ifdef SPLITCUBES_WITH_RENDER

#include "interrupts.h"
#include "pictures.h"
#include "progress.h"

#include <splitcubes/core/error.h>
#include <splitcubes/io/read_surface.h>
#include <splitcubes/render/image.h>
#include <splitcubes/render/video.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>

namespace splitcubes::app {

namespace {

namespace fs = std::filesystem;

struct Options {
    std::string folder;
    std::vector<std::string> outputs;
    int every = 1;
    int width = 0, height = 0;
    double frames_per_second = 0;
    bool links = false;
};

std::vector<fs::path> frame_files(const fs::path& folder) {
    const fs::path surfaces = folder / "surface";
    if (!fs::is_directory(surfaces))
        throw InputError(folder.string(), "holds no folder 'surface'",
                         "give the folder that `splitcubes run` wrote");
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(surfaces))
        if (entry.path().extension() == ".ply") files.push_back(entry.path());
    if (files.empty())
        throw InputError(surfaces.string(), "holds no .ply frames",
                         "run the scene with output.format \"ply\"");
    std::sort(files.begin(), files.end());
    return files;
}

// What the run wrote beside a frame's surface.
fs::path links_file(const fs::path& folder, const fs::path& surface) {
    return folder / "links" / surface.filename();
}

// FILE.mp4 takes all frames; FOLDER or FOLDER/ gets one PNG a frame; a file
// NAME.png gets the last frame.
struct Targets {
    std::optional<fs::path> video, folder, still;
};

Targets targets_of(const std::vector<std::string>& outputs) {
    Targets out;
    for (const std::string& text : outputs) {
        const fs::path path(text);
        const std::string ending = path.extension().string();
        if (ending == ".mp4" || ending == ".mkv" || ending == ".mov") {
            out.video = path;
        } else if (ending == ".png" && !fs::is_directory(path)) {
            out.still = path;
        } else if (ending.empty() || fs::is_directory(path)) {
            out.folder = path;
        } else {
            throw InputError(text, "has an unknown ending", "give FILE.mp4, FILE.png or a folder for PNGs");
        }
    }
    return out;
}

int render_frames(const Options& options) {
    const Targets targets = targets_of(options.outputs);
    if (options.every < 1) throw InputError("--every", "must be at least 1");
    std::vector<fs::path> files = frame_files(options.folder);
    RunScene scene = read_run_scene(options.folder);
    if (options.width > 0) scene.description.camera.width = options.width;
    if (options.height > 0) scene.description.camera.height = options.height;
    std::vector<fs::path> chosen;
    for (std::size_t k = 0; k < files.size(); k += static_cast<std::size_t>(options.every))
        chosen.push_back(files[k]);
    if (!targets.video && !targets.folder) chosen.assign(1, files.back());
    if (targets.folder) {
        std::error_code error;
        fs::create_directories(*targets.folder, error);
        if (error) throw InputError(targets.folder->string(), "cannot be made: " + error.message());
    }
    Progress progress("render", chosen.size());
    PictureMaker maker(scene, files);
    std::optional<render::VideoWriter> video;
    if (targets.video) {
        render::VideoOptions video_options;
        video_options.width = scene.description.camera.width;
        video_options.height = scene.description.camera.height;
        const double step =
            scene.description.time_step * scene.description.output.every_nth_frame * options.every;
        video_options.frames_per_second =
            options.frames_per_second > 0 ? options.frames_per_second : 1 / step;
        video.emplace(*targets.video, video_options);
    }
    // ffmpeg would go on with the frames it has.
    std::optional<AtEnd> at_end;
    if (video) at_end.emplace([&video] { video->kill_now(); });
    std::optional<render::Picture> last;
    std::size_t done = 0;
    for (const fs::path& file : chosen) {
        const double time = frame_time(scene, file);
        const geometry::SurfaceMesh surface = io::read_surface(file);
        last = options.links ? maker.draw(read_links(links_file(options.folder, file)), surface, time)
                             : maker.draw(surface, time);
        if (video) video->add(*last);
        if (targets.folder) render::write_png(*targets.folder / (file.stem().string() + ".png"), *last);
        ++done;
        progress.show(done, std::to_string(done) + (done == 1 ? " picture" : " pictures"));
        if (interrupted()) break;
    }
    progress.finish();
    if (video && !interrupted()) video->finish();
    if (targets.still && last) render::write_png(*targets.still, *last);
    if (interrupted()) {
        std::cerr << "interrupted after " << done << " of " << chosen.size() << " pictures\n";
        return 1;
    }
    for (const std::string& out : options.outputs) std::cout << out << '\n';
    return 0;
}

}  // namespace

void add_render_command(CLI::App& app, Run& run) {
    const auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("render", "Draws the frames of a run, offscreen");
    command->add_option("run", options->folder, "Folder that `splitcubes run` wrote")->required();
    command
        ->add_option("-o,--output", options->outputs,
                     "FILE.mp4 (video), FILE.png (the last frame), or a folder (a PNG a frame)")
        ->required();
    command->add_option("--every", options->every, "Draws every Nth frame (1)");
    command->add_option("--width", options->width, "Pixels; default: the scene's");
    command->add_option("--height", options->height, "Pixels; default: the scene's");
    command->add_flag(
        "--links", options->links,
        "Draws the links between phyxels by visibility, the surface over them; needs `run --links`");
    command->add_option("--fps", options->frames_per_second,
                        "Frames a second of the video; default: real time");
    command->callback([options, &run] { run = [options] { return render_frames(*options); }; });
}

}  // namespace splitcubes::app

#else

#include <splitcubes/core/error.h>

namespace splitcubes::app {

void add_render_command(CLI::App& app, Run& run) {
    CLI::App* command = app.add_subcommand("render", "Draws the frames of a run (not built in)");
    command->allow_extras();
    command->callback([&run] {
        run = []() -> int {
            throw JobError("this program was built without OpenGL (SPLITCUBES_BUILD_RENDER)");
        };
    });
}

}  // namespace splitcubes::app

#endif
