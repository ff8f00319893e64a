// What a step did: the stages it went through and what it counted.
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
inline constexpr std::size_t stage_count = 11;
inline constexpr std::array<const char*, stage_count> stage_names = {
    "move_tools",        "cut_edges",          "retessellate",           "label_pieces",
    "update_visibility", "resample",           "rebuild_neighbourhoods", "detect_contacts",
    "integrate",         "update_node_frames", "update_surface"};

/// Things that went wrong in a step and were mended; bits of StepReport::flags.
enum Flag : std::uint32_t {
    flag_inverted = 1,         // phyxels turned inside out; their next step is backward Euler
    flag_not_converged = 2,    // the linear solve stopped at its iteration limit
    flag_non_finite = 4,       // phyxels went on without elastic force for this step
    flag_frame_fallback = 8,   // nodes that see no phyxel took a neighbour's frame
    flag_rank_deficient = 16,  // neighbourhoods that no longer span space
};
/// Names of the flags that are set, separated by '|'; "-" for none.
std::string flag_text(std::uint32_t flags);

struct StepReport {
    double time = 0;                            // s, at the end of the step
    std::array<double, stage_count> seconds{};  // wall clock of each stage
    // Totals over all bodies, at the end of the step.
    std::size_t phyxels = 0;
    std::size_t pairs = 0;      // undirected, that see each other
    std::size_t cut_edges = 0;  // between inside nodes
    std::size_t surface_cells = 0;
    std::size_t triangles = 0;
    std::size_t pieces = 0;
    double mass = 0;                       // kg
    Vec3 momentum = Vec3::Zero();          // kg m/s
    Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s, about the origin
    double kinetic_energy = 0;             // J
    double elastic_energy = 0;             // J
    double top_speed = 0;                  // m/s
    // Of this step.
    std::size_t new_cut_edges = 0;
    std::size_t changed_cells = 0;
    std::size_t disks = 0;  // pairs whose visibility was evaluated
    std::size_t new_phyxels = 0;
    int solver_iterations = 0;
    int substeps = 0;                 // of the explicit solver, the most of any body; 1 of the implicit one
    std::size_t contacts = 0;         // that push
    std::vector<Vec3> handle_forces;  // N, on the bodies, per handle, body by body
    std::uint32_t flags = 0;

    double& stage_seconds(Stage stage) { return seconds[static_cast<std::size_t>(stage)]; }
    double total_seconds() const {
        double sum = 0;
        for (const double s : seconds) sum += s;
        return sum;
    }
};

}  // namespace splitcubes::body
