// What the two ways of making a solid share: the crossings of the skin, gathered
// in any order by several threads and put into the grid in one that is kind to
// memory; and what was too thin for the grid. Not part of the public interface.
#pragma once

#include <splitcubes/geometry/grid_sweep.h>
#include <splitcubes/splitting/node_grid.h>
#include <splitcubes/splitting/solidify.h>

#include <functional>
#include <span>
#include <vector>

namespace splitcubes::splitting {

struct SkinCut {
    GridEdge edge;
    double parameter;
    Vec3 normal;
};

/// Material between two crossings of an edge whose ends are both outside.
struct ThinMaterial {
    double thickness;  // m, across the sheet
    std::uint32_t triangles[2];
};

/// What one part of the work found; parts are joined in order.
struct SkinPart {
    std::vector<SkinCut> cuts;
    std::vector<ThinMaterial> lost;
    std::size_t gap_edges = 0;
    bool overlap = false;                     // somewhere the mesh winds more than once
    bool positive = false, negative = false;  // which winding numbers there are

    void append(SkinPart&& other);
};

/// Calls visit(part, crossings of one edge, state) for each grid edge that the mesh
/// meets, a line's edges in their order; joins the parts. The state is zero where a
/// line begins and from there on what the visitor makes of it.
SkinPart for_each_edge(
    const geometry::GridCrossings& sweep, const Parallel& parallel,
    const std::function<void(SkinPart&, std::span<const geometry::EdgeCrossing>, int&)>& visit);

/// Cuts the edges, brick by brick.
void cut_skin(NodeGrid& grid, const std::vector<SkinCut>& cuts);

/// Records material that an edge with two outside ends crosses. Not so the tip of a
/// wedge with a node inside it nearby: the surface's own vertices reproduce that.
void note_thin(const NodeGrid& grid, const geometry::TriangleMesh& mesh, const geometry::EdgeCrossing& enter,
               const geometry::EdgeCrossing& leave, SkinPart& part);

/// Writes the findings about thin material into the report.
void report_thin(const geometry::TriangleMesh& mesh, const RestGrid& rest, std::vector<ThinMaterial>& lost,
                 SolidifyReport& report);

NodeGrid solidify_exact(const geometry::TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report,
                        const Parallel& parallel);
NodeGrid solidify_by_winding(const geometry::TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report,
                             const Parallel& parallel);

}  // namespace splitcubes::splitting
