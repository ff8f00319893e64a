#include <splitcubes/core/error.h>
#include <splitcubes/geometry/grid_sweep.h>
#include <splitcubes/splitting/sheet_cut.h>

#include <cmath>

namespace splitcubes::splitting {

std::vector<std::int32_t> cut_with_sheet(NodeGrid& grid, const geometry::TriangleMesh& sheet,
                                         std::int32_t cut_number) {
    for (const geometry::Triangle& t : sheet.triangles)
        for (const std::uint32_t v : t)
            if (v >= sheet.positions.size() || !sheet.positions[v].allFinite())
                throw InputError("cutting sheet",
                                 "vertex " + std::to_string(v) + " is missing or not finite");
    std::vector<std::int32_t> slots;
    const geometry::GridCrossings sweep = geometry::sweep_grid(grid.rest(), sheet);
    const auto& all = sweep.crossings;
    for (std::size_t i = 0; i < all.size();) {
        std::size_t best = i, end = i;
        for (; end < all.size() && all[end].axis == all[i].axis && all[end].node == all[i].node; ++end)
            if (std::abs(all[end].parameter - 0.5) < std::abs(all[best].parameter - 0.5)) best = end;
        const GridEdge edge{all[i].node, all[i].axis};
        if (grid.inside(edge.node) && grid.inside(edge.upper())) {
            const std::int32_t slot =
                grid.cut(edge, all[best].parameter, geometry::triangle_normal(sheet, all[best].triangle),
                         Origin::cut, cut_number);
            if (slot >= 0) slots.push_back(slot);
        }
        i = end;
    }
    return slots;
}

CrossedEdges edges_crossed_by_sheet(const NodeGrid& grid, const geometry::TriangleMesh& sheet) {
    CrossedEdges out;
    const auto all = geometry::sweep_grid(grid.rest(), sheet).crossings;
    for (std::size_t i = 0; i < all.size(); ++i)
        if (i == 0 || all[i].axis != all[i - 1].axis || all[i].node != all[i - 1].node)
            out.add(grid, {all[i].node, all[i].axis});
    return out;
}

}  // namespace splitcubes::splitting
