// Explains in a sentence why a tool, a blade or a sheet cut nothing.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/geometry/length_unit.h>
#include <splitcubes/geometry/plane.h>
#include <splitcubes/splitting/crossed_edges.h>
#include <splitcubes/world/idle_tools.h>
#include <nlohmann/json_fwd.hpp>

#include <optional>
#include <string>

namespace splitcubes::app {

/// A cutter that cut nothing, and the body that it was meant for.
struct IdleCutter {
    geometry::Box cutter, body;  // m, in the same frame
    splitting::CrossedEdges crossed;
    double cell_size = 0;  // m
    std::string body_name = "the mesh";
    std::string cell_option = "--cell-size";  // the option that makes cells smaller
    geometry::LengthUnit unit = {};           // of the lengths in the note
    bool sweeps_nothing = false;              // of a blade: see sweeps_nothing
    std::optional<geometry::CuttingPlane> plane = {};
};

/// Returns whether the blade, from t0 to t1 (s), moves only along its own edges or not at all.
bool sweeps_nothing(const cutting::Blade& blade, double t0, double t1);

/// Returns one word for reports: "missed", "already_cut" or "near_surface".
const char* idle_reason(const splitting::CrossedEdges& crossed);
/// Returns a note; the caller puts the cutter's name in front.
std::string idle_note(const IdleCutter& idle);

/// Prints a note for each tool of a run that cut nothing. Returns their names and reasons, which also include
/// "never_active" and "last_step".
nlohmann::ordered_json note_idle_tools(const body::IdleTools& tools, const body::World& world);

}  // namespace splitcubes::app
