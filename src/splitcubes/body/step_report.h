// Report of a step: its stages with their times, and counts.
#pragma once

#include <splitcubes/math/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace splitcubes::body {

/// The stages of World::step, in order; docs/architecture.md, the timers and the
/// metrics files use the same names.
enum class Stage : std::uint8_t {
    move_tools,
    cut_edges,
    tear,
    retessellate,
    label_pieces,
    update_visibility,
    resample,
    rebuild_neighbourhoods,
    detect_contacts,
    integrate,
    update_node_frames,
    update_surface,
};
inline constexpr std::size_t stage_count = 12;
inline constexpr std::array<const char*, stage_count> stage_names = {"move_tools",
                                                                     "cut_edges",
                                                                     "tear",
                                                                     "retessellate",
                                                                     "label_pieces",
                                                                     "update_visibility",
                                                                     "resample",
                                                                     "rebuild_neighbourhoods",
                                                                     "detect_contacts",
                                                                     "integrate",
                                                                     "update_node_frames",
                                                                     "update_surface"};

/// Problems in a step that were detected and handled; bits of StepReport::flags.
enum Flag : std::uint32_t {
    flag_inverted = 1,         // inverted phyxels; their next step is backward Euler
    flag_not_converged = 2,    // the linear solve stopped at its iteration limit
    flag_non_finite = 4,       // phyxels that moved without elastic force in this step
    flag_frame_fallback = 8,   // nodes without visible phyxels, which took a neighbour's frame
    flag_rank_deficient = 16,  // neighbourhoods that no longer span space
    flag_energy_excess = 32,   // energy that no source explains was removed (meshless::EnergyGuard)
    flag_took_implicit = 64,   // explicit steps that would have needed too many substeps
};
/// Returns the names of the set flags, separated by '|'; "-" for none.
std::string flag_text(std::uint32_t flags);

/// Tool reaction: force and torque of the bodies on a tool, averaged over the interval in which it moved; the
/// torque is about the origin of the tool's frame. Nothing acts back on the bodies.
///
/// The blade's edge contributes the cutting resistance times the area cut per length moved, against the
/// motion. Each cut grid edge stands for the area cell^2 |n_axis| of the cut, which sums to the area of a
/// plane. The blade's sides contribute friction times the normal force between the cut faces within the
/// sides' reach of the edge (which would press on a blade between them), against the motion. Thickness and
/// wedging of the blade are not modelled.
struct ToolForce {
    Vec3 force = Vec3::Zero();   // N, world
    Vec3 torque = Vec3::Zero();  // N m, world
    double area = 0;             // m^2 at rest, cut in this step
    double work = 0;             // J, cutting resistance times area

    /// Adds a force, N, that acts at a point, m, world. tool: frame of the tool, world from own.
    void add_force(const Isometry& tool, const Vec3& point, const Vec3& added);
};

/// Work on the bodies from outside in one step, J. That of gravity is the change of the potential energy;
/// that of moving colliders is not known.
struct StepWork {
    double holds = 0;    // on what moves with them, and by that on the rest
    double handles = 0;  // by their springs
};

/// State of all bodies at the end of a step.
struct StepTotals {
    std::size_t phyxels = 0;
    std::size_t pairs = 0;      // undirected, with visibility above 0
    std::size_t cut_edges = 0;  // between inside nodes
    std::size_t surface_cells = 0;
    std::size_t triangles = 0;
    std::size_t pieces = 0;
    double mass = 0;                       // kg
    Vec3 momentum = Vec3::Zero();          // kg m/s
    Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s, about the origin
    double kinetic_energy = 0;             // J
    double elastic_energy = 0;             // J
    double contact_energy = 0;             // J, in contact springs, and held by hits
    double potential_energy = 0;           // J, of gravity, zero at the origin
    double top_speed = 0;                  // m/s
};

/// Changes and contacts of one step, over all bodies.
struct StepCounts {
    std::size_t new_cut_edges = 0;  // by tools and by tearing
    std::size_t torn_edges = 0;     // by tearing
    std::size_t changed_cells = 0;
    std::size_t disks = 0;  // pairs whose visibility was evaluated
    std::size_t new_phyxels = 0;
    std::size_t contacts = 0;  // with a normal force
};

/// Work of the time integration in one step, over all bodies.
struct StepSolver {
    int iterations = 0;                    // of the linear solver
    int substeps = 0;                      // maximum over the bodies; the implicit solver makes 1
    int retries = 0;                       // steps of bodies that were repeated with smaller substeps
    std::size_t energy_excess_pieces = 0;  // pieces with an energy excess
    double energy_removed = 0;             // J, removed from pieces with an energy excess
};

/// Report of one step of a World.
struct StepReport {
    double time = 0;                            // s, at the end of the step
    std::array<double, stage_count> seconds{};  // wall clock of each stage
    StepTotals totals;
    StepCounts counts;
    StepSolver solver;
    StepWork work;
    std::vector<ToolForce> tools;     // per tool
    std::vector<Vec3> handle_forces;  // N, on the bodies, per handle, body by body
    std::uint32_t flags = 0;          // see Flag

    double& stage_seconds(Stage stage) { return seconds[static_cast<std::size_t>(stage)]; }
    double total_seconds() const {
        double sum = 0;
        for (const double s : seconds) sum += s;
        return sum;
    }
};

}  // namespace splitcubes::body
