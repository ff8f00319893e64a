#include "simulate.h"

#include "checkpoints.h"
#include "idle_notes.h"
#include "interrupts.h"
#include "opengl_backend.h"
#include "output_targets.h"
#include "progress.h"
#include "report.h"
#include "run_output.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/io/atomic_file.h>
#include <splitcubes/scene/build.h>

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
    // Steps are never left half done.
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
            "its scene begins in state " + state + ", it was recorded from " + recording.first_state,
            "a mesh file or the program (" + recording.program + ") is not what it was then");
    body::follow_tracks(world, recording.tracks);
}

void write_recording(const std::string& file, const scene::SceneDescription& description,
                     const body::World& world, const std::string& first_state, int frames) {
    scene::Recording recording{description, SPLITCUBES_VERSION, body::motion_tracks(world, frames),
                               first_state, world.state_hash().text()};
    recording.scene.frames = frames;
    io::write_file(file, scene::recording_text(recording));
}

// The recorded last state belongs to the recorded number of frames.
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

int simulate(const scene::SceneDescription& description, const RunOptions& options,
             const scene::Recording* replayed) {
    check_report_output(options.record);
    Stopwatch watch;
    scene::BuildReport built;
    const std::unique_ptr<body::World> world = make_world(description, built);
    const std::string first_state = world->state_hash().text();
    if (replayed != nullptr) follow(*replayed, options.changed, *world);

    const Checkpoints checkpoints(fs::path(options.out) / "checkpoint.bin", description, *world);
    RunOutput::Past past;
    if (!options.resume.empty()) past = checkpoints.restore(*world, options.resume, description.frames);
    RunOutput output(options.out, description, *world, built.models, past);
    output.seconds().setup = watch.lap();
    const Patience patience;
    if (past.frame < 0) output.write_frame(*world, body::StepReport{}, 0);
    body::IdleTools idle_tools(*world);
    Progress progress("run " + description.name, static_cast<std::size_t>(description.frames));
    int frame = std::max(past.frame, 0);
    while (frame < description.frames && !interrupted()) {
        const body::StepReport report = world->step();
        ++frame;
        idle_tools.observe(*world, report);
        output.seconds().simulate += report.total_seconds();
        output.write_frame(*world, report, frame);
        if (options.checkpoint_every > 0 && frame % options.checkpoint_every == 0)
            checkpoints.write(*world, output.metrics());
        progress.show(static_cast<std::size_t>(frame), std::to_string(frame) + " frames, " +
                                                           std::to_string(report.pieces) +
                                                           (report.pieces == 1 ? " piece" : " pieces"));
    }
    progress.finish();
    print_notes(description.name, output.flags().notes());
    if (!interrupted()) output.set_idle_tools(note_idle_tools(idle_tools, *world));
    output.finish(*world, frame, interrupted());
    if (!options.record.empty() && frame > 0)
        write_recording(options.record, description, *world, first_state, frame);
    const std::string state = world->state_hash().text();
    std::cout << options.out << ": " << frame << " frames, state " << state << '\n';
    if (interrupted()) {
        checkpoints.write(*world, output.metrics());
        std::cerr << "interrupted after frame " << frame << " of " << description.frames
                  << "; what was written is whole; go on with --resume " << checkpoints.file().string()
                  << '\n';
        return 1;
    }
    return replayed != nullptr ? compare_states(*replayed, options.changed, state, frame) : 0;
}

}  // namespace splitcubes::app
