// Parts shared by the two ways to make a solid: boundary crossings, which several threads collect in any
// order and which are then added to the grid in a cache-friendly order; and records of material that is too
// thin for the grid. Not part of the public interface.
#pragma once

#include <splitcubes/geometry/grid_sweep.h>
#include <splitcubes/splitting/node_grid.h>
#include <splitcubes/splitting/solidify.h>

#include <functional>
#include <span>
#include <vector>

namespace splitcubes::splitting {

struct BoundaryCut {
    GridEdge edge;
    double parameter;
    Vec3 normal;
};

/// Material between two crossings of an edge whose ends are both outside.
struct ThinMaterial {
    double thickness;  // m, across the sheet
    std::uint32_t triangles[2];
};

/// Findings of one part of the work; parts are joined in order.
struct BoundaryPart {
    std::vector<BoundaryCut> cuts;
    std::vector<ThinMaterial> lost;
    std::size_t gap_edges = 0;
    bool overlap = false;                     // the winding number exceeds 1 in magnitude somewhere
    bool positive = false, negative = false;  // signs of the winding numbers that occur

    void append(BoundaryPart&& other);
};

/// Calls visit(part, crossings of one edge, state) for each grid edge that the mesh meets, in order along
/// each grid line, and joins the parts. The state is zero at the start of a line and is then updated by the
/// visitor.
BoundaryPart for_each_edge(
    const geometry::GridCrossings& sweep, const Parallel& parallel,
    const std::function<void(BoundaryPart&, std::span<const geometry::EdgeCrossing>, int&)>& visit);

/// Cuts the edges, brick by brick.
void cut_boundary_edges(NodeGrid& grid, const std::vector<BoundaryCut>& cuts);

/// Records material on an edge whose ends are both outside. The tip of a wedge with an inside node nearby is
/// not recorded: the surface's own vertices reproduce it.
void note_thin(const NodeGrid& grid, const geometry::TriangleMesh& mesh, const geometry::EdgeCrossing& enter,
               const geometry::EdgeCrossing& leave, BoundaryPart& part);

/// Writes the findings about thin material into the report.
void report_thin(const geometry::TriangleMesh& mesh, const RestGrid& rest, std::vector<ThinMaterial>& lost,
                 SolidifyReport& report);

NodeGrid solidify_exact(const geometry::TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report,
                        const Parallel& parallel);
NodeGrid solidify_by_winding(const geometry::TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report,
                             const Parallel& parallel);

}  // namespace splitcubes::splitting
