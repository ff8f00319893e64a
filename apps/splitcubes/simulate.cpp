#include "simulate.h"

#include "checkpoints.h"
#include "idle_notes.h"
#include "input_copies.h"
#include "interrupts.h"
#include "opengl_backend.h"
#include "output_folder.h"
#include "output_targets.h"
#include "progress.h"
#include "report.h"
#include "run_output.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/io/atomic_file.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/inputs.h>
#include <splitcubes/scene/world_course.h>

#include <algorithm>
#include <iostream>
#include <memory>

namespace splitcubes::app {

namespace fs = std::filesystem;

namespace {

std::unique_ptr<body::World> make_world(const scene::SceneDescription& description,
                                        scene::BuildReport& built) {
    const auto parallel = std::make_shared<Parallel>(description.threads);
    Progress progress("set-up of " + description.name);
    parallel->watch(&progress);
    auto world = scene::build_world(description, parallel, built,
                                    opengl_backend_maker(description.occlusion.backend == "opengl"));
    // Steps are not cancelled half way.
    parallel->watch(nullptr);
    progress.finish();
    for (const auto& [name, note] : built.notes) print_notes(name, {note});
    return world;
}

void follow(const scene::Recording& recording, bool changed, body::World& world) {
    const std::string state = world.state_hash().text();
    if (!changed && !recording.first_state.empty() && recording.first_state != state)
        throw InputError(
            "recording",
            "its scene starts in state " + state + ", it was recorded from " + recording.first_state,
            "a file that a mesh refers to (a buffer, say) or the program (" + recording.program +
                ") has changed since");
    body::follow_tracks(world, recording.tracks);
}

std::vector<fs::path> files_read(const RunOptions& options, scene::SceneDescription& description) {
    std::vector<fs::path> out{options.source, options.resume};
    for (const scene::Input& input : scene::inputs_of(description)) out.push_back(*input.file);
    return out;
}

// Checks before the work that a recording does not replace another file of the run.
void check_recording(const fs::path& file, scene::SceneDescription& description, const OutputFolder& folder) {
    if (file.empty()) return;
    check_report_output(file);
    for (const scene::Input& input : scene::inputs_of(description))
        check_distinct({input.file->string(), file.string()});
    if (folder.may_write(file))
        throw InputError(file.string(), "has the name of a file of the run",
                         "give the recording another name");
}

fs::path parent_folder(const fs::path& file) {
    return fs::absolute(file).lexically_normal().parent_path();
}

// A recording refers to files by paths relative to its folder if those of the run are below it, and otherwise
// has copies of its own beside it: a path that leads upward would reveal the machine's layout.
scene::SceneDescription recorded_scene(const fs::path& file, scene::SceneDescription in_run,
                                       const InputCopies& copies) {
    if (file.empty()) return in_run;
    const fs::path base = parent_folder(file);
    const std::vector<scene::Input> inputs = scene::inputs_of(in_run);
    const bool below = std::all_of(inputs.begin(), inputs.end(), [&](const scene::Input& input) {
        return *input.file->lexically_relative(base).begin() != "..";
    });
    if (below) return in_run;
    const fs::path own = base / (file.stem().string() + "-inputs");
    copies.write([&](const std::string& name) {
        const fs::path folder = (own / name).parent_path();
        std::error_code error;
        fs::create_directories(folder, error);
        if (error) throw JobError(folder.string() + ": cannot be made (" + error.message() + ")");
        return own / name;
    });
    return copies.scene_in(own);
}

void write_recording(const fs::path& file, scene::SceneDescription description, const body::World& world,
                     const std::string& first_state, int frames) {
    description.frames = frames;
    const scene::Recording recording{std::move(description), SPLITCUBES_VERSION,
                                     body::motion_tracks(world, frames), first_state,
                                     world.state_hash().text()};
    io::write_file(file, scene::recording_text(recording, parent_folder(file)));
}

// Removes files of an earlier run from the folder and copies the scene's inputs into it; returns the scene
// that refers to the copies.
scene::SceneDescription begin_folder(OutputFolder& folder, const InputCopies& copies, int past,
                                     std::vector<io::Model>& models) {
    const std::string inputs = "inputs/";
    folder.clear([&](const std::string& name) {
        if (name.starts_with(inputs)) return copies.has_name(name.substr(inputs.size()));
        return !RunOutput::is_stale(name, past) || copies.has_source(folder.path() / name);
    });
    copies.write([&](const std::string& name) { return folder.add(inputs + name); });
    copies.move_textures(folder.path() / inputs, models);
    return copies.scene_in(folder.path() / inputs);
}

// The recorded last state is valid for the recorded number of frames only.
int compare_states(const scene::Recording& recording, bool changed, const std::string& state, int frames) {
    if (frames != recording.scene.frames || recording.last_state.empty()) return 0;
    if (state == recording.last_state) {
        std::cout << "the same state as recorded\n";
        return 0;
    }
    (changed ? std::cout : std::cerr) << "the recorded state is " << recording.last_state << ", not " << state
                                      << (changed ? "; the scene was changed" : "") << '\n';
    return changed ? 0 : 1;
}

}  // namespace

int simulate(const scene::SceneDescription& wanted, const RunOptions& options,
             const scene::Recording* replayed) {
    Stopwatch watch;
    scene::SceneDescription description = wanted;
    OutputFolder folder(options.out, run_folder, options.force, files_read(options, description));
    check_recording(options.record, description, folder);
    const SavedRun saved = options.resume.empty() ? SavedRun() : read_checkpoint(options.resume);
    scene::find_inputs(description, std::vector<fs::path>(options.inputs.begin(), options.inputs.end()));
    Checkpoints checkpoints(folder, description);
    if (!options.resume.empty()) checkpoints.check(saved, options.resume);
    scene::BuildReport built;
    const std::unique_ptr<body::World> world = make_world(description, built);
    const std::string first_state = world->state_hash().text();
    scene::WorldCourse course(description, *world);
    if (replayed != nullptr) {
        follow(*replayed, options.changed, *world);
        course.leave_motions();
    }

    checkpoints.begin(*world);
    RunOutput::Past past;
    if (!options.resume.empty()) past = checkpoints.restore(*world, course, saved, options.resume);
    const InputCopies copies(description, built);
    description = begin_folder(folder, copies, past.frame, built.models);
    const scene::SceneDescription recorded = recorded_scene(options.record, description, copies);
    RunOutput output(folder, description, *world, course.course(), built.models, past);
    output.seconds().setup = watch.lap();
    const Patience patience;
    if (past.frame < 0) output.write_frame(*world, body::StepReport{}, 0);
    body::IdleTools idle_tools(*world);
    Progress progress("run " + description.name, static_cast<std::size_t>(description.frames));
    int frame = std::max(past.frame, 0);
    while (frame < description.frames && !interrupted()) {
        course.advance(*world);
        const body::StepReport report = world->step();
        ++frame;
        idle_tools.observe(*world, report);
        output.seconds().simulate += report.total_seconds();
        output.write_frame(*world, report, frame);
        if (options.checkpoint_every > 0 && frame % options.checkpoint_every == 0)
            checkpoints.write(*world, course, output.metrics());
        progress.show(static_cast<std::size_t>(frame),
                      std::to_string(frame) + " frames, " + std::to_string(report.totals.pieces) +
                          (report.totals.pieces == 1 ? " piece" : " pieces"));
    }
    progress.finish();
    print_notes(description.name, output.flags().notes());
    if (!interrupted()) output.set_idle_tools(note_idle_tools(idle_tools, *world));
    output.finish(*world, frame, interrupted());
    if (!options.record.empty() && frame > 0)
        write_recording(options.record, recorded, *world, first_state, frame);
    const std::string state = world->state_hash().text();
    std::cout << options.out << ": " << frame << " frames, state " << state << '\n';
    if (interrupted()) {
        checkpoints.write(*world, course, output.metrics());
        std::cerr << "interrupted after frame " << frame << " of " << description.frames
                  << "; the files written are complete; go on with --resume " << checkpoints.file().string()
                  << '\n';
        return 1;
    }
    return replayed != nullptr ? compare_states(*replayed, options.changed, state, frame) : 0;
}

}  // namespace splitcubes::app
