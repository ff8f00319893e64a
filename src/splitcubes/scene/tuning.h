#pragma once

/// Tuning constants of scenes: when advice is given, memory estimates and tolerances of input. Each comment
/// gives the unit (none for pure numbers), the sensible range and the effect of larger and smaller values.
/// Limits on the size of input stand in parse.h, recording.h and reader.h.

#include <cstddef>
#include <cstdint>

namespace splitcubes::scene::tuning {

/// Notes on worlds that will not behave as their author may expect (advice.cpp).
namespace advice {

/// Nodes, maximum of those compared in an overlap of two bodies; more are subsampled. More are more accurate
/// and take more time.
inline constexpr double max_overlap_nodes = 1e6;
/// Notes printed for each kind of overlap, 1 to 50; further ones are only counted.
inline constexpr std::size_t max_overlap_notes = 5;
/// Share of the volume, 0 to 1, that must be thin for a note. Larger misses bodies with thin limbs; smaller
/// notes every rim.
inline constexpr double min_thin_share = 0.1;
/// Phyxels, 2 to 6, across which a part is not thin; three are a third too soft in bending.
inline constexpr int min_phyxels_across = 4;
/// Hz, 5 to 50; faster vibrations are seen as a blur, and their damping is not noted.
inline constexpr double max_visible_frequency = 12;
/// Share of the amplitude, 0 to 1, that a vibration may lose in a period by the time step alone before it is
/// noted.
inline constexpr double max_amplitude_loss = 0.5;
/// Share of the amplitude, 1 - max_amplitude_loss to 1, kept by the time step that the note suggests.
inline constexpr double suggested_amplitude = 0.9;

}  // namespace advice

/// Building of worlds (build.cpp, implicit_model.cpp).
namespace build {

/// Cells along the longest side of the distance grid of a mesh as collider, 16 to 256. More follow its
/// surface better; memory and set-up grow with their cube. The public interface has the same
/// (api/internal/tuning.h).
inline constexpr int collider_cells = 64;
/// B, memory of such a collider; measured. Larger refuses scenes that would fit; smaller lets the machine run
/// out of memory.
inline constexpr double bytes_per_collider = 3e6;
/// B, memory of an implicit shape per node; measured on solids.
inline constexpr double implicit_bytes_per_node = 2;
/// B, the same per cell face of its bounding box: assumes that the surface is as large as that.
inline constexpr double implicit_bytes_per_face = 2700;

}  // namespace build

/// Solids of tools (instrument.cpp).
namespace instrument {

/// s, 0 to 1: how long before its motion and after it a tool is in pictures. Longer shows the tools of
/// strokes that follow each other at the same time.
inline constexpr double shown_beyond = 0.25;

}  // namespace instrument

/// Sampling of motions that are no keyframes (motion.cpp).
namespace motion {

/// Samples of a part's smooth path between two of its keyframes, 4 to 64. More follow it better and make
/// sweeps of more areas.
inline constexpr int samples_per_smooth_span = 16;
/// Degrees, 1 to 15, that composed motions turn at most between two samples. Smaller follows them better and
/// makes sweeps of more areas.
inline constexpr double sample_degrees = 5;

}  // namespace motion

/// Motions, starts and ends that depend on the state (course.cpp, course_state.cpp, played_scene.cpp).
namespace course {

/// s, 1e-12 to a hundredth of a time step: times that differ by less are the same. Those of steps are
/// computed in several ways, which differ by rounding. Larger delays what starts; smaller makes motions
/// differ after what is known to have begun.
inline constexpr double same_time = 1e-9;
/// s, latest time in a checkpoint; more than any run lasts.
inline constexpr double max_time = 1e9;
/// Keyframes of all things together that the scene of a run writes out, 1000 to 15000. More follow long runs
/// better; the text must stay within ParseLimits::bytes.
inline constexpr std::int64_t max_played_keyframes = 10000;

}  // namespace course

/// Reading of recordings and search for inputs (recording.cpp, inputs.cpp).
namespace input {

/// Deviation of a recorded motion from a rigid one, 1e-9 to 1e-3. Larger accepts scaled bodies, smaller
/// refuses rounding.
inline constexpr double rigid_tolerance = 1e-6;
/// Files, maximum in a folder that is searched for an input that has moved. More take time.
inline constexpr std::size_t max_candidates = 100000;

}  // namespace input

}  // namespace splitcubes::scene::tuning
