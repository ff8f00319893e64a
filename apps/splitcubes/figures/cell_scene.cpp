#include "cell_scene.h"

#include <algorithm>

namespace splitcubes::app::figures {

using namespace splitting;

std::vector<DrawnQuad> quads_of_cell(CellMask mask) {
    NodeGrid grid = solid_grid(Vec3i::Constant(2));
    for (int e = 0; e < edge_count; ++e)
        if (mask >> e & 1)
            grid.cut(cell_edge(Vec3i::Zero(), e), 0.5, Vec3::Unit(edge_axis(e)), Origin::cut, 0);
    const Surface surface(grid);
    std::vector<DrawnQuad> out;
    if (surface.cells().empty()) return out;
    const auto table = Table::get().quads(mask);
    const auto quads = surface.quads(surface.cells()[0]);
    for (std::size_t i = 0; i < table.size(); ++i) {
        DrawnQuad& quad = out.emplace_back();
        quad.table = table[i];
        for (std::size_t k = 0; k < 4; ++k) quad.corners[k] = surface.vertices()[quads[i].vertices[k]].rest;
    }
    return out;
}

void draw_quads(Svg& svg, const CellView& view, std::vector<DrawnQuad> quads,
                const std::vector<std::size_t>& colour_of_fan, double opacity) {
    const auto depth = [&](const DrawnQuad& q) {
        double sum = 0;
        for (const Vec3& p : q.corners) sum += view.depth(p);
        return sum;
    };
    std::stable_sort(quads.begin(), quads.end(),
                     [&](const DrawnQuad& a, const DrawnQuad& b) { return depth(a) > depth(b) + 1e-9; });
    for (const DrawnQuad& q : quads) {
        const PieceColours& colours = colours_of(colour_of_fan[q.table.fan]);
        std::array<Vec2, 4> outline;
        for (std::size_t k = 0; k < 4; ++k) outline[k] = view.at(q.corners[k]);
        svg.polygon(outline, {.fill = colours.fill, .stroke = colours.line, .fill_opacity = opacity});
    }
}

void draw_crossings(Svg& svg, const CellView& view, CellMask mask) {
    for (int e = 0; e < edge_count; ++e) {
        if (!(mask >> e & 1)) continue;
        const Vec3 a = corner_node(Vec3i::Zero(), edge_corner(e, 0)).cast<double>();
        draw_crossing(svg, view.at(a + 0.5 * Vec3::Unit(edge_axis(e))));
    }
}

}  // namespace splitcubes::app::figures
