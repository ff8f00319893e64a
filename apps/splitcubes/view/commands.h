// Commands of tools and panels to the simulation. They and the steps at which they were carried out
// determine a session, so that a recording of them repeats it to the last bit.
#pragma once

#include "picking.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace splitcubes::view {

enum class CommandKind {
    // Commands of the simulation that are recorded.
    set_parameter,  // `name`, `value`
    apply_preset,   // `name`
    undo,
    redo,
    begin_stroke,  // `slot`, `points`, `frames[0]`, `anchor`: lowers a blade
    move_stroke,   // `slot`, `frames`, `anchor`
    end_stroke,    // `slot`
    // `slot`, `anchor`, `frames[0]`: rotation of the material, `value`: stiffness, `radius`. Of a jaw of
    // forceps
    // also `partner`, `limit`, `points[0]`: centre of its region from the anchor, rest space, `points[1]`:
    // how
    // it closes, world, `frames[1]`: the forceps, whose x axis goes from one jaw to the other.
    begin_pull,
    move_pull,  // `slot`, `points[0]`: the target
    end_pull,   // `slot`
    pin,        // `slot`: the pull stays
    unpin,      // `slot`
    drop,       // blades and pulls that are under way, where time went on from an earlier step
    // Commands of the simulation that are not recorded.
    restart,
    resume_at,        // `value`: the step to go on from
    open,             // `name`: a file
    save_surface,     // `name`: a file
    save_pieces,      // `name`: a folder
    save_checkpoint,  // `name`: a file
    save_recording,   // `name`: a file
    save_scene,       // `name`: a file, of the scene with the strokes
    save_path,        // `name`: a file, of the strokes
    save_curve,       // `name`: a file, .svg or .csv
    show_field,       // `value`: a Field; `slot`: Detail bits
    seek,             // `value`: the frame of a run, or the earlier step of a simulation, to show
    // Commands of the loop around it.
    play,
    pause,
    single_step,
    set_speed,  // `value`
};

/// See CommandKind for the fields that a kind reads.
struct Command {
    CommandKind kind = CommandKind::pause;
    int slot = 0;
    std::string name{};
    double value = 0;
    double radius = 0;               // m, rest space
    double limit = 0;                // N, of a jaw's force; 0: none
    int partner = 0;                 // slot of the other jaw; 0: it is no jaw
    std::vector<Vec3> points{};      // m
    std::vector<Isometry> frames{};  // world from own, at even times of the next step
    int frames_per_step = 0;         // of a stroke that goes by itself; 0: all in the next step
    bool has_anchor = false;
    MaterialPoint anchor{};    // that `frames` move with until they are taken
    std::uint64_t number = 0;  // in the order of being sent
};

/// A command that was carried out before a step.
struct RecordedCommand {
    std::int64_t step = 0;
    Command command;
};

bool is_recorded(CommandKind kind);

/// Recordings: the scene or mesh, and a line of JSON a command.
struct Recording {
    std::filesystem::path scene;
    std::map<std::string, double> initial;  // parameters at the start
    std::int64_t steps = 0;
    std::uint64_t state_hash = 0;  // after the last step
    std::vector<RecordedCommand> commands;
};
void write_session_recording(const std::filesystem::path& file, const Recording& recording);
/// Throws InputError.
Recording read_session_recording(const std::filesystem::path& file);
/// Tells whether a file begins as a recording does.
bool is_recording(const std::filesystem::path& file);

}  // namespace splitcubes::view
