// From a triangle mesh to a grid of inside and outside nodes with the mesh's
// crossings on the edges between them: the paper's initial surface, the mesh
// taken as one big cut (Pietroni et al. 2007, section 8).
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/length_unit.h>
#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/splitting/node_grid.h>

#include <string>
#include <vector>

namespace splitcubes::splitting {

struct SolidifyReport {
    geometry::LengthUnit unit = {};  // of the lengths in notes and errors; to be set before
    bool exact = false;              // closed: integer winding, no tolerance
    bool overlap = false;            // the mesh winds more than once somewhere; exact only
    bool opposed = false;            // it winds one way here and the other way there; exact only
    std::size_t nodes_inside = 0;
    std::size_t gap_edges = 0;       // both ends inside, void in between: cut, so that the gap separates
    std::size_t bisected_edges = 0;  // cross a hole of the mesh: found by bisection of the winding number
    /// Both ends outside, material in between, no inside node around: too thin for this cell size.
    std::size_t lost_thin_edges = 0;
    double lost_thickness = 0;       // m, median of the lost material
    double keeping_cell_size = 0;    // m, would keep nine tenths of the lost edges' material
    geometry::TriangleMesh lost;     // the triangles of the mesh on either side of the lost material
    std::vector<std::string> notes;  // one line each: what was found and what was done
};

/// Copies of a triangle count once, and triangles that are turned both ways are turned
/// to one where that makes the mesh closed (geometry/repair.h).
/// A node is inside where the mesh winds around it (winding number not zero: parts
/// that overlap are united, a reversed inner shell is a cavity, an inside-out mesh
/// a solid). For a mesh that is not closed or not consistently oriented, inside is
/// where the generalised winding number exceeds one half (Jacobson et al. 2013).
/// The grid must cover the mesh with a layer of nodes to spare (grid_around).
/// Throws InputError where a position is not finite, an index out of range, nothing
/// is inside, or the mesh is a sheet: more than 30 % of the surface would have to be
/// made up.
NodeGrid solidify(const geometry::TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report,
                  const Parallel& parallel);

}  // namespace splitcubes::splitting
