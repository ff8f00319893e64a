#include <splitcubes/core/error.h>
#include <splitcubes/geometry/grid_sweep.h>
#include <splitcubes/splitting/cut_front.h>
#include <splitcubes/splitting/sheet_cut.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

namespace splitcubes::splitting {

namespace {

// Returns the sides of a sheet's triangles that are of one triangle only, in cells.
std::vector<std::array<Vec3, 2>> rim_of(const RestGrid& rest, const geometry::TriangleMesh& sheet) {
    std::vector<std::array<std::uint32_t, 2>> sides;
    for (const geometry::Triangle& t : sheet.triangles)
        for (std::size_t k = 0; k < 3; ++k)
            sides.push_back({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
    std::sort(sides.begin(), sides.end());
    std::vector<std::array<Vec3, 2>> out;
    for (auto side = sides.begin(); side != sides.end();) {
        const auto end = std::upper_bound(side, sides.end(), *side);
        if (end - side == 1)
            out.push_back(
                {rest.to_grid(sheet.positions[(*side)[0]]), rest.to_grid(sheet.positions[(*side)[1]])});
        side = end;
    }
    return out;
}

// Moves the fronts beside new cut edges to where the sheet's rim passes their faces.
void move_fronts_to_rim(NodeGrid& grid, const geometry::TriangleMesh& sheet,
                        std::span<const std::int32_t> slots) {
    const std::vector<CutFront> fronts = fronts_beside(grid, slots);
    if (fronts.empty()) return;
    const std::vector<std::array<Vec3, 2>> rim = rim_of(grid.rest(), sheet);
    for (const CutFront& front : fronts) {
        const GridFace face = face_beside(grid.crossing(front.slot).edge, front.side);
        const FrontRay ray = ray_of(grid, front);
        std::optional<double> farthest;
        for (const auto& [from, to] : rim) {
            const double below = face.node[face.axis] - from[face.axis],
                         length = to[face.axis] - from[face.axis];
            if (!(below * length >= 0) || !(std::abs(below) <= std::abs(length)) || length == 0) continue;
            const Vec3 at = from + below / length * (to - from) - face.node.cast<double>();
            const auto share = share_along(ray, {at[(face.axis + 1) % 3], at[(face.axis + 2) % 3]});
            if (share && !(farthest >= share)) farthest = share;
        }
        if (farthest) grid.move_front(front, step_at(*farthest));
    }
}

}  // namespace

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
    move_fronts_to_rim(grid, sheet, slots);
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
