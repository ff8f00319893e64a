#include "command_line.h"
#include "commands.h"
#include "output_folder.h"
#include "output_targets.h"

#include <splitcubes/core/error.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#ifdef SPLITCUBES_WITH_RENDER
#include "interrupts.h"
#include "moving_solids.h"
#include "pictures.h"
#include "progress.h"

#include <splitcubes/io/mesh_format.h>
#include <splitcubes/io/write_animation.h>
#include <splitcubes/render/image.h>
#include <splitcubes/render/video.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <iostream>
#endif

namespace splitcubes::app {

namespace {

namespace fs = std::filesystem;

constexpr int largest_picture = 16384;  // pixels along a side; supported by all OpenGL implementations

struct RenderOptions {
    std::string folder;
    std::vector<std::string> outputs;
    int every = 1;
    int width = 0, height = 0;
    double frames_per_second = 0;
    bool links = false, force = false;
};

// FILE.mp4 and FILE.glb take all frames; FOLDER or FOLDER/ gets one PNG per frame; a file NAME.png gets the
// last frame.
struct Targets {
    std::optional<fs::path> video, folder, still, animation;
    bool has_pictures() const { return video || folder || still; }
};

Targets targets_of(const std::vector<std::string>& outputs) {
    Targets out;
    const auto once = [](std::optional<fs::path>& target, const fs::path& path) {
        if (target)
            throw InputError(path.string(), "is a second output of the same kind, beside " + target->string(),
                             "give one film, one animation, one picture and one folder at most");
        target = path;
    };
    for (const std::string& text : outputs) {
        if (text.empty())
            throw InputError("--output", "names nothing", "give FILE.mp4, FILE.glb, FILE.png or a folder");
        const fs::path path(text);
        const std::string ending = path.extension().string();
        if (ending == ".mp4" || ending == ".mkv" || ending == ".mov") {
            check_output_file(path);
            once(out.video, path);
        } else if (ending == ".glb") {
            check_output_file(path);
            once(out.animation, path);
        } else if (ending == ".png" && !fs::is_directory(path)) {
            check_output_file(path);
            once(out.still, path);
        } else if (ending.empty() || fs::is_directory(path)) {
            check_output_folder(path);
            once(out.folder, path);
        } else {
            throw InputError(text, "has an unknown ending",
                             "give FILE.mp4, FILE.glb, FILE.png or a folder for PNGs");
        }
    }
    return out;
}

#ifdef SPLITCUBES_WITH_RENDER

// Tells whether it is a mesh whose name is a number.
bool is_frame_mesh(const fs::path& file) {
    const std::string name = file.stem().string();
    return io::format_of_extension(file) && !name.empty() &&
           name.find_first_not_of("0123456789") == std::string::npos;
}

std::vector<fs::path> frame_files(const fs::path& folder) {
    const fs::path surfaces = folder / "surface";
    if (!fs::is_directory(surfaces))
        throw InputError(folder.string(), "holds no folder 'surface'",
                         "give the folder that `splitcubes run` wrote");
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(surfaces))
        if (is_frame_mesh(entry.path())) files.push_back(entry.path());
    if (files.empty())
        throw InputError(surfaces.string(), "holds no frames (.ply, .obj, .stl or .glb)",
                         "give the folder that `splitcubes run` wrote");
    std::sort(files.begin(), files.end());
    // A run that was resumed in another format has frames of both.
    const auto same_number = [](const fs::path& a, const fs::path& b) { return a.stem() == b.stem(); };
    files.erase(std::unique(files.begin(), files.end(), same_number), files.end());
    return files;
}

// Returns the file of links for a frame's surface.
fs::path links_file(const fs::path& folder, const fs::path& surface) {
    return folder / "links" / (surface.stem().string() + ".ply");
}

// Refuses a film or still that collides with a picture in the folder.
void check_others(const Targets& targets, const std::optional<OutputFolder>& folder) {
    if (folder && targets.still && folder->may_write(*targets.still))
        throw InputError(targets.still->string(), "has the name of a picture in the folder for pictures",
                         "give another name or folder");
}

// Writes the frames and the solids of the run.
int write_animation(const fs::path& to, const RunScene& scene, const std::vector<fs::path>& frames) {
    Progress progress("animation", frames.size());
    io::AnimationWriter writer(to);
    std::vector<double> times;
    for (const fs::path& file : frames) {
        times.push_back(frame_time(scene, file));
        geometry::SurfaceMesh surface = read_frame(file);
        // They double the file, and programs that show films do not read them.
        surface.rest.clear();
        writer.add_frame(times.back(), surface);
        progress.show(times.size(), std::to_string(times.size()) + " frames");
        if (interrupted()) break;
    }
    progress.finish();
    if (interrupted()) {
        std::cerr << "interrupted after " << times.size() << " of " << frames.size() << " frames\n";
        return 1;
    }
    for (const MovingSolid& solid : moving_solids(scene.description, times))
        writer.add_solid(solid.name, solid.mesh, solid.material, solid.times, solid.frames);
    writer.finish();
    return 0;
}

double seconds_a_frame(const scene::SceneDescription& scene, const RenderOptions& options) {
    return options.frames_per_second > 0 ? 1 / options.frames_per_second
                                         : scene.time_step * scene.output.every_nth_frame * options.every;
}

int draw_pictures(const RenderOptions& options, const Targets& targets, const RunScene& scene,
                  const std::vector<fs::path>& files, const std::vector<fs::path>& chosen) {
    std::optional<OutputFolder> folder;
    if (targets.folder) folder.emplace(*targets.folder, pictures_folder, options.force);
    check_others(targets, folder);
    Progress progress("render", chosen.size());
    PictureMaker maker(scene, boxes_of(files));
    if (folder) folder->clear([](const std::string&) { return false; });
    std::optional<render::VideoWriter> video;
    if (targets.video) {
        render::VideoOptions video_options;
        video_options.width = scene.description.camera.width;
        video_options.height = scene.description.camera.height;
        video_options.frames_per_second = 1 / seconds_a_frame(scene.description, options);
        video.emplace(*targets.video, video_options);
    }
    // Without this ffmpeg would finish the film with the frames so far.
    std::optional<AtEnd> at_end;
    if (video) at_end.emplace([&video] { video->kill_now(); });
    std::optional<render::Picture> last;
    std::size_t done = 0;
    for (const fs::path& file : chosen) {
        const double time = frame_time(scene, file);
        const geometry::SurfaceMesh surface = read_frame(file);
        last = options.links ? maker.draw(read_links(links_file(options.folder, file)), surface, time)
                             : maker.draw(surface, time);
        if (video) video->add(*last);
        if (folder) render::write_png(folder->add(file.stem().string() + ".png"), *last);
        ++done;
        progress.show(done, std::to_string(done) + (done == 1 ? " picture" : " pictures"));
        if (interrupted()) break;
    }
    progress.finish();
    if (video && !interrupted()) video->finish();
    if (targets.still && last) render::write_png(*targets.still, *last);
    if (!interrupted()) return 0;
    std::cerr << "interrupted after " << done << " of " << chosen.size() << " pictures\n";
    return 1;
}

int render_frames(const RenderOptions& options) {
    const Targets targets = targets_of(options.outputs);
    const std::vector<fs::path> files = frame_files(options.folder);
    RunScene scene = read_run_scene(options.folder);
    if (options.width > 0) scene.description.camera.width = options.width;
    if (options.height > 0) scene.description.camera.height = options.height;
    std::vector<fs::path> chosen;
    for (std::size_t k = 0; k < files.size(); k += static_cast<std::size_t>(options.every))
        chosen.push_back(files[k]);
    if (targets.animation)
        if (const int code = write_animation(*targets.animation, scene, chosen); code != 0) return code;
    if (!targets.video && !targets.folder) chosen.assign(1, files.back());
    if (targets.has_pictures())
        if (const int code = draw_pictures(options, targets, scene, files, chosen); code != 0) return code;
    for (const std::string& out : options.outputs) std::cout << out << '\n';
    return 0;
}

#else

int render_frames(const RenderOptions& options) {
    targets_of(options.outputs);
    throw JobError("this program was built without OpenGL (SPLITCUBES_BUILD_RENDER)");
}

#endif

}  // namespace

void add_render_command(CommandLine& line) {
    const auto options = std::make_shared<RenderOptions>();
    Command& command = line.add("render", "Draws the frames of a run, offscreen");
    command.add_text("RUN", "", options->folder, "Folder that `splitcubes run` wrote")
        .required()
        .completes(folders());
    command
        .add_list(
            "-o,--output", "TARGET", options->outputs,
            "FILE.mp4, .mkv or .mov (video), FILE.glb (an animated scene), FILE.png (the last frame), or a "
            "folder (a PNG a frame)")
        .required()
        .completes(files({"mp4", "mkv", "mov", "glb", "png"}));
    command.add_integer("--every", "N", options->every, {1, 1000000}, "Draws every Nth frame (1)");
    const Range pixels{1, largest_picture};
    command.add_integer("--width", "N", options->width, pixels, "Pixels; default: the scene's");
    command.add_integer("--height", "N", options->height, pixels, "Pixels; default: the scene's");
    command.add_flag(
        "--links", options->links,
        "Draws the links between phyxels by visibility, the surface over them; needs `run --links`");
    add_force_option(command, options->force, pictures_folder);
    command.add_number("--fps", "N", options->frames_per_second, above(0, 1000),
                       "Frames a second of the video; default: real time");
    command.example("splitcubes render pear -o pear.mp4");
    command.run = [options] { return render_frames(*options); };
}

}  // namespace splitcubes::app
