// Solids of tools: what is drawn behind a cutting edge, and what a solid tool pushes with.
#pragma once

#include <splitcubes/geometry/finish.h>
#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/scene/description.h>

#include <utility>
#include <vector>

namespace splitcubes::scene {

struct BuildReport;

/// A part of an instrument, in the tool's own frame.
struct InstrumentPart {
    geometry::TriangleMesh mesh;  // closed, oriented outward
    geometry::Finish finish;
    bool is_grip = false;  // a handle, not what works
};

/// Returns the parts of a tool's instrument; none without one. Mesh files are read, and what they refer to is
/// reported. Throws InputError for a mesh that cannot be read.
std::vector<InstrumentPart> instrument_parts(const ToolDescription& tool, BuildReport* report = nullptr);

/// Returns when a tool is in pictures, s: while it moves or cuts, and shortly before and after, so that the
/// strokes of one knife leave no knives behind; a solid tool always is.
std::pair<double, double> shown_times(const ToolDescription& tool);

/// Returns all parts in one mesh.
geometry::TriangleMesh instrument_mesh(const ToolDescription& tool, BuildReport* report = nullptr);

}  // namespace splitcubes::scene
