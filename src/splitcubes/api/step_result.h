// Results of a time step.
#pragma once

#include <splitcubes/api/types.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace splitcubes {

/// Force and torque of the bodies on a tool, averaged over the interval whose cut this step made, one step
/// late; torque about the origin of the tool's frame. They come from the work of cutting
/// (MaterialSettings::cutting_resistance) and from friction on the tool's sides.
///
/// The work is done edge by edge of the grid: a blade that moves along a plane of the grid meets a row of
/// edges at once, and its force comes in pulses, of the right work. For a device that a hand holds, average
/// over the time that the blade takes for a cell, or use smaller cells.
struct ToolResult {
    ToolId tool;          ///< whose
    Vector3 force;        ///< N, world
    Vector3 torque;       ///< N m, world
    double cut_area = 0;  ///< m^2 at rest, cut in this step
    double cut_work = 0;  ///< J, resistance times area
};

/// The force of a handle on its body.
struct HandleResult {
    HandleId handle;  ///< whose
    Vector3 force;    ///< N, world
};

/// A point of a body's surface that is pushed, or of crushed material inside it.
struct ContactPoint {
    BodyId body;             ///< of the point
    Vector3 position;        ///< m, world
    Vector3 force;           ///< N, world, on this body: pressure and friction
    bool by_a_body = false;  ///< by a body or a piece; else by a collider or the ground
};

/// Wall-clock time of a stage of the step.
struct StageTime {
    const char* name = "";  ///< as docs/architecture.md has it; lives as long as the program
    double seconds = 0;     ///< s
};

/// A tool began to cut a body, after a step in which it cut no edge of its grid. A slow blade begins once a
/// cell.
struct CutBegan {
    ToolId tool;  ///< that cuts
    BodyId body;  ///< that is cut
};
/// A piece came off. Pieces of a body are numbered from 0; the larger part keeps the number.
struct PieceSeparated {
    BodyId body;              ///< of the pieces
    std::int32_t piece = 0;   ///< the new one
    std::int32_t parent = 0;  ///< that it belonged to
};
/// A body tore.
struct Torn {
    BodyId body;            ///< that tore
    std::size_t edges = 0;  ///< grid edges that gave way in the step
};
/// A piece is so small, or a fragment rotates so fast, that it moves as a rigid body from now on.
struct FragmentMadeRigid {
    BodyId body;             ///< of the piece
    std::int32_t piece = 0;  ///< its number
};

/// Faults of a step that were corrected; bits of StepResult::warnings.
enum StepWarning : std::uint32_t {
    warning_inverted = 1,         ///< samples turned inside out
    warning_not_converged = 2,    ///< the linear solve stopped at its limit
    warning_non_finite = 4,       ///< samples went without elastic force for the step
    warning_frame_fallback = 8,   ///< nodes without a sample of their own followed a neighbour
    warning_rank_deficient = 16,  ///< samples whose neighbours do not span space
    warning_energy_excess = 32,   ///< energy that nothing had put in was taken
    warning_took_implicit = 64,   ///< explicit steps that would have needed too many substeps
};

/// Results of one step. Spans are valid until the next call that is not const.
struct StepResult {
    double time = 0;                                   ///< s, at the end of the step
    std::span<const StageTime> stages;                 ///< in order
    std::span<const ToolResult> tools;                 ///< in the order in which they were added
    std::span<const HandleResult> handles;             ///< body by body
    std::span<const CutBegan> cuts_began;              ///< events of the step
    std::span<const PieceSeparated> pieces_separated;  ///< events of the step
    std::span<const Torn> torn;                        ///< events of the step
    std::span<const FragmentMadeRigid> made_rigid;     ///< events of the step
    std::size_t pieces = 0;                            ///< of all bodies
    std::size_t new_cut_edges = 0;                     ///< grid edges, by tools and tearing
    std::size_t contacts = 0;                          ///< points that push
    double kinetic_energy = 0;                         ///< J
    double elastic_energy = 0;                         ///< J
    int solver_iterations = 0;                         ///< of the linear solve
    std::uint32_t warnings = 0;                        ///< StepWarning bits
};

}  // namespace splitcubes
