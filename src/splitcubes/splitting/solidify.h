// Conversion of a triangle mesh to a grid of inside and outside nodes, with the mesh's crossings on the edges
// between them: the paper's initial surface, where the mesh acts as one big cut (Pietroni et al. 2007,
// section 8).
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/length_unit.h>
#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/splitting/node_grid.h>

#include <string>
#include <vector>

namespace splitcubes::splitting {

struct SolidifyReport {
    geometry::LengthUnit unit = {};  // of lengths in notes and errors; an input
    bool exact = false;              // closed: integer winding, no tolerance
    bool overlap = false;            // the winding number exceeds 1 in magnitude somewhere; exact only
    bool opposed = false;            // winding numbers of both signs occur; exact only
    std::size_t nodes_inside = 0;
    std::size_t gap_edges = 0;       // both ends inside with void in between: cut, so that the gap separates
    std::size_t bisected_edges = 0;  // cross a hole of the mesh: found by bisection of the winding number
    /// Number of edges with both ends outside, material in between and no inside node around: too thin for
    /// this cell size.
    std::size_t lost_thin_edges = 0;
    double lost_thickness = 0;        // m, median of the lost material
    double sufficient_cell_size = 0;  // m, would keep nine tenths of the lost edges' material
    geometry::TriangleMesh lost;      // triangles of the mesh on either side of the lost material
    std::vector<std::string> notes;   // one line each: a finding and its treatment
};

/// Makes the solid of a mesh. Copies of a triangle count once; triangles of mixed orientation are reoriented
/// if that makes the mesh closed (geometry/repair.h).
///
/// For a closed mesh a node is inside if the mesh's winding number there is not zero: overlapping parts are
/// united, a reversed inner shell is a cavity, an inside-out mesh is a solid. For a mesh that is not closed
/// or not consistently oriented a node is inside if the generalised winding number exceeds one half (Jacobson
/// et al. 2013).
///
/// The grid must cover the mesh with a layer of nodes to spare (grid_around). Throws InputError if a position
/// is not finite, an index is out of range, no node is inside, or the mesh is a sheet: more than 30 % of the
/// surface would have to be invented.
NodeGrid solidify(const geometry::TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report,
                  const Parallel& parallel);

}  // namespace splitcubes::splitting
