#include "cell_scene.h"
#include "figures.h"

#include <string>

namespace splitcubes::app::figures {

namespace {

using namespace splitting;

constexpr int node = 0;  // the corner whose quads are drawn

CellMask edges_of_node(int count) {
    unsigned mask = 0;
    for (int e = 0; e < edge_count; ++e)
        if (edge_corner(e, 0) == node && count-- > 0) mask |= 1U << e;
    return static_cast<CellMask>(mask);
}

// Returns the mask of all edges along x, which a sheet across x cuts.
CellMask edges_along_x() {
    unsigned mask = 0;
    for (int e = 0; e < edge_count; ++e)
        if (edge_axis(e) == 0) mask |= 1U << e;
    return static_cast<CellMask>(mask);
}

void draw_cuboid(Svg& svg, const CellView& view) {
    view.draw_cube(svg, Vec3::Zero(), Vec3::Constant(0.5), {.stroke = soft, .width = 1});
}

void draw_quad_marks(Svg& svg, const CellView& view, const std::vector<DrawnQuad>& quads) {
    const std::string& colour = colours_of(0).line;
    for (const DrawnQuad& q : quads) {
        draw_edge_vertex(svg, view.at(q.corners[0]), colour);
        draw_face_vertex(svg, view.at(q.corners[1]), colour);
        draw_face_vertex(svg, view.at(q.corners[3]), colour);
        draw_centre_vertex(svg, view.at(q.corners[2]), colour);
    }
}

void draw_cell(Svg& svg, const CellView& view, CellMask mask, const std::string& words) {
    view.draw_cube(svg, Vec3::Zero(), Vec3::Ones(), {.stroke = soft, .width = 1.2});
    draw_cuboid(svg, view);
    std::vector<DrawnQuad> own;
    for (const DrawnQuad& q : quads_of_cell(mask))
        if (q.table.corner == node) own.push_back(q);
    draw_quads(svg, view, own, std::vector<std::size_t>(8, 0), 0.75);
    draw_crossings(svg, view, mask);
    draw_quad_marks(svg, view, own);
    draw_node(svg, view.at(Vec3::Zero()), colours_of(0).line);
    const Vec2 middle = view.panel.at({0.67, 0});
    svg.text({middle[0], 218}, words);
    svg.text({middle[0], 236}, std::to_string(own.size()) + (own.size() == 1 ? " quad" : " quads"),
             Anchor::middle, 13, ink, true);
}

void draw_quad_legend(Svg& svg, double y) {
    const std::string& colour = colours_of(0).line;
    draw_node(svg, {46, y}, colour);
    svg.text({58, y}, "the node", Anchor::start);
    svg.line({136, y}, {158, y}, {.stroke = soft, .width = 1});
    svg.text({166, y}, "its cuboid in the cell", Anchor::start);
    draw_crossing(svg, {332, y});
    svg.text({344, y}, "cut edge", Anchor::start);
    draw_edge_vertex(svg, {430, y}, colour);
    svg.text({442, y}, "edge vertex", Anchor::start);
    draw_face_vertex(svg, {546, y}, colour);
    svg.text({558, y}, "face vertex", Anchor::start);
    draw_centre_vertex(svg, {662, y}, colour);
    svg.text({676, y}, "centre vertex", Anchor::start);
}

}  // namespace

Svg draw_quads() {
    Svg svg(860, 290);
    const std::pair<CellMask, const char*> cells[] = {{edges_of_node(1), "one of its edges cut"},
                                                      {edges_of_node(2), "two of its edges"},
                                                      {edges_of_node(3), "all three: it is cut off"},
                                                      {edges_along_x(), "a sheet across the cell"}};
    double x = 30;
    for (const auto& [mask, words] : cells) {
        draw_cell(svg, {{{x, 180}, 118}}, mask, words);
        x += 208;
    }
    draw_quad_legend(svg, 268);
    return svg;
}

}  // namespace splitcubes::app::figures
