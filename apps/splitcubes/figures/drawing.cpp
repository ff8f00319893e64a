#include "drawing.h"

#include <splitcubes/splitting/table.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>

namespace splitcubes::app::figures {

using namespace splitting;

const PieceColours& colours_of(std::size_t k) {
    static const std::array<PieceColours, 4> all{
        {{"#c6dcf0", "#1f5fa0"}, {"#fbdcb4", "#b8600b"}, {"#cbe8c6", "#2a7a36"}, {"#e0d6ee", "#6a4a9a"}}};
    return all[k % all.size()];
}

void draw_node(Svg& svg, const Vec2& at, const std::string& colour) {
    svg.circle(at, 4, {.fill = colour});
}

void draw_crossing(Svg& svg, const Vec2& at) {
    const Style style{.stroke = red, .width = 2};
    svg.line(at + Vec2(-4, -4), at + Vec2(4, 4), style);
    svg.line(at + Vec2(-4, 4), at + Vec2(4, -4), style);
}

void draw_edge_vertex(Svg& svg, const Vec2& at, const std::string& colour) {
    svg.circle(at, 2.8, {.fill = colour});
}

void draw_face_vertex(Svg& svg, const Vec2& at, const std::string& colour) {
    svg.circle(at, 4, {.fill = "#ffffff", .stroke = colour, .width = 2});
}

void draw_centre_vertex(Svg& svg, const Vec2& at, const std::string& colour) {
    const std::array<Vec2, 4> diamond{at + Vec2(6, 0), at + Vec2(0, 6), at + Vec2(-6, 0), at + Vec2(0, -6)};
    svg.polygon(diamond, {.fill = "#ffffff", .stroke = colour, .width = 2});
}

namespace {
constexpr double turn = 28 * std::numbers::pi / 180, tilt = 24 * std::numbers::pi / 180;
}  // namespace

Vec2 CellView::at(const Vec3& p) const {
    const double right = std::cos(turn) * p[0] + std::sin(turn) * p[1];
    const double away = -std::sin(turn) * p[0] + std::cos(turn) * p[1];
    return panel.at({right, std::cos(tilt) * p[2] + std::sin(tilt) * away});
}

double CellView::depth(const Vec3& p) const {
    const double away = -std::sin(turn) * p[0] + std::cos(turn) * p[1];
    return std::cos(tilt) * away - std::sin(tilt) * p[2];
}

void CellView::draw_cube(Svg& svg, const Vec3& low, const Vec3& high, const Style& style) const {
    std::array<Vec3, corner_count> corners;
    std::size_t hidden = 0;
    for (int c = 0; c < corner_count; ++c) {
        const auto i = static_cast<std::size_t>(c);
        for (int axis = 0; axis < 3; ++axis) corners[i][axis] = corner_bit(c, axis) ? high[axis] : low[axis];
        if (depth(corners[i]) > depth(corners[hidden])) hidden = i;
    }
    for (int e = 0; e < edge_count; ++e) {
        const auto a = static_cast<std::size_t>(edge_corner(e, 0)),
                   b = static_cast<std::size_t>(edge_corner(e, 1));
        Style drawn = style;
        if (a == hidden || b == hidden) drawn.dashes = "3 4";
        svg.line(at(corners[a]), at(corners[b]), drawn);
    }
}

NodeGrid solid_grid(const Vec3i& node_count) {
    RestGrid rest;
    rest.node_count = node_count;
    NodeGrid grid(rest);
    for (int z = 0; z < node_count[2]; ++z)
        for (int y = 0; y < node_count[1]; ++y) grid.set_inside_row(y, z, 0, node_count[0]);
    return grid;
}

namespace {

// Finds vertices of the layer by kind, lower node, axis and instance.
class LayerVertices {
  public:
    LayerVertices(const Surface& surface, int level) {
        for (std::size_t i = 0; i < surface.vertices().size(); ++i) {
            const SurfaceVertex& v = surface.vertices()[i];
            if (v.alive() && v.lowest_node[2] == level && (v.kind == VertexKind::edge) == (v.axis != 2))
                index_[{static_cast<int>(v.kind), v.lowest_node[0], v.lowest_node[1], v.axis, v.instance}] =
                    static_cast<std::int32_t>(i);
        }
    }
    std::int32_t at(VertexKind kind, const Vec3i& position, int axis, int instance) const {
        const auto found = index_.find({static_cast<int>(kind), position[0], position[1], axis, instance});
        return found == index_.end() ? -1 : found->second;
    }

  private:
    std::map<std::array<int, 5>, std::int32_t> index_;
};

constexpr int lower_face = 4;  // of a cell, normal to z

Vec3i ring_node(const Vec3i& face, int k) {
    return corner_node(face, face_corner(lower_face, k % 4));
}
GridEdge ring_grid_edge(const Vec3i& face, int k) {
    return cell_edge(face, face_edge(lower_face, k % 4));
}

Patch::Point edge_point(const LayerVertices& vertices, const Vec3i& face, int k, const Vec3i& home) {
    const GridEdge edge = ring_grid_edge(face, k);
    return {home, vertices.at(VertexKind::edge, edge.node, edge.axis, edge.node == home ? 0 : 1)};
}

// Returns the patch whose first ring corner is `start`; the ring edge before it is cut.
Patch cut_patch(const LayerVertices& vertices, const Vec3i& face, unsigned mask, int start) {
    Patch out{face, {}, false};
    const int instance = Table::get().face(mask).instance[static_cast<std::size_t>(start)];
    out.outline.push_back({ring_node(face, start), vertices.at(VertexKind::face, face, 2, instance)});
    out.outline.push_back(edge_point(vertices, face, start + 3, ring_node(face, start)));
    int k = start;
    for (;; ++k) {
        out.outline.push_back({ring_node(face, k)});
        if (mask >> (k % 4) & 1U) break;
    }
    out.outline.push_back(edge_point(vertices, face, k, ring_node(face, k)));
    return out;
}

}  // namespace

std::vector<Patch> patches_of_layer(const NodeGrid& grid, const Surface& surface, int level) {
    const LayerVertices vertices(surface, level);
    std::vector<Patch> out;
    const Vec3i n = grid.rest().node_count;
    for (int y = 0; y + 1 < n[1]; ++y)
        for (int x = 0; x + 1 < n[0]; ++x) {
            const Vec3i face(x, y, level);
            unsigned mask = 0;
            for (int k = 0; k < 4; ++k)
                mask |= static_cast<unsigned>(grid.is_cut(ring_grid_edge(face, k))) << k;
            if (mask == 0 && grid.inside(face)) {
                Patch& whole = out.emplace_back();
                whole.face = face;
                for (int k = 0; k < 4; ++k) whole.outline.push_back({ring_node(face, k)});
            }
            for (int k = 0; k < 4; ++k)
                if (mask >> ((k + 3) % 4) & 1U && grid.inside(ring_node(face, k)))
                    out.push_back(cut_patch(vertices, face, mask, k));
        }
    return out;
}

}  // namespace splitcubes::app::figures
