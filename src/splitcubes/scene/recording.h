// Recordings: a run's scene, the motions that drove it, and its first and last state.
#pragma once

#include <splitcubes/scene/description.h>
#include <splitcubes/world/motion_tracks.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace splitcubes::scene {

struct Recording {
    /// `frames` is the number of recorded steps.
    SceneDescription scene;
    std::string program;  // version that wrote the recording
    std::vector<body::MotionTrack> tracks;
    // World::state_hash before the first and after the last step, as text; empty: unknown.
    std::string first_state, last_state;
};

/// Limits on the input of parse_recording.
struct RecordingLimits {
    static constexpr std::size_t bytes = std::size_t{1} << 29;
    static constexpr std::size_t memory = std::size_t{1} << 31;  // bytes, of the parsed text
    static constexpr std::size_t samples = 10'000'000;           // of a track
    static constexpr std::size_t tracks = 100'000;
    static constexpr std::size_t name_length = 300;  // bytes, of a driven object's name
};

/// Returns the JSON text of a recording for a file in `folder`, one line per sample: `format` ("splitcubes
/// recording 2"), `program` (its version), `scene` (resolved, as in a scene file in that folder), `frames`,
/// `first_state`, `last_state`, and `tracks`, each with `tool`, `constraint`, `handle` or `collider` (its
/// name), `times` (s) and `places` (12 numbers each: the rows of the 3 x 4 matrix world from own, m).
std::string recording_text(const Recording& recording, const std::filesystem::path& folder);

/// Reads a recording; numbers keep all bits. Throws InputError, whose location is `name` with the line as for
/// scenes, for recordings of other versions and for poses that are not rigid motions (within 1e-6).
Recording parse_recording(std::string_view text, const std::string& name,
                          const std::filesystem::path& folder);
Recording read_recording(const std::filesystem::path& path);

}  // namespace splitcubes::scene
