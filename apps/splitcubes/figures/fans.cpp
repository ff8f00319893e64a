#include "cell_scene.h"
#include "figures.h"

#include <splitcubes/splitting/placement.h>

#include <bit>
#include <map>
#include <string>

namespace splitcubes::app::figures {

namespace {

using namespace splitting;

// A component of a cell and its fans.
struct FanCase {
    CellMask mask = 0;
    std::uint8_t component = 0;
    std::vector<int> fans;
};

// Returns the component with this many fans in the mask with the fewest cut edges.
FanCase fewest_cuts_with(std::size_t fan_count) {
    FanCase best;
    for (int m = 0; m < mask_count; ++m) {
        const auto mask = static_cast<CellMask>(m);
        if (best.mask != 0 && std::popcount(mask) >= std::popcount(best.mask)) continue;
        const CellConfiguration& cell = Table::get().cell(mask);
        std::map<std::uint8_t, std::vector<int>> fans;
        for (int fan = 0; fan < cell.fan_count; ++fan)
            fans[cell.component[cell.fan_corner[static_cast<std::size_t>(fan)]]].push_back(fan);
        for (const auto& [component, some] : fans)
            if (some.size() == fan_count) best = {mask, component, some};
    }
    return best;
}

std::vector<DrawnQuad> quads_of(const FanCase& fans) {
    std::vector<DrawnQuad> out;
    for (const DrawnQuad& q : quads_of_cell(fans.mask))
        if (Table::get().cell(fans.mask).component[q.table.corner] == fans.component) out.push_back(q);
    return out;
}

// Returns the position that a single centre vertex for all crossings would have.
Vec3 common_centre(const std::vector<DrawnQuad>& quads) {
    std::map<int, Vec3> faces;
    std::map<int, CellCrossing> crossings;
    for (const DrawnQuad& q : quads) {
        faces[q.table.first_face] = q.corners[1];
        faces[q.table.second_face] = q.corners[3];
        crossings[q.table.edge] = {q.corners[0], Vec3::Unit(edge_axis(q.table.edge)), false, 0};
    }
    Vec3 mean = Vec3::Zero();
    for (const auto& [face, position] : faces) mean += position / static_cast<double>(faces.size());
    std::vector<CellCrossing> all;
    for (const auto& [edge, crossing] : crossings) all.push_back(crossing);
    return place_centre(all, false, mean);
}

void draw_panel(Svg& svg, const CellView& view, const FanCase& fans, std::vector<DrawnQuad> quads,
                bool split) {
    std::vector<std::size_t> colour_of_fan(8, 0);
    for (std::size_t k = 0; k < fans.fans.size(); ++k)
        colour_of_fan[static_cast<std::size_t>(fans.fans[k])] = k;
    if (!split) {
        const Vec3 centre = common_centre(quads);
        for (DrawnQuad& q : quads) q.corners[2] = centre;
    }
    view.draw_cube(svg, Vec3::Zero(), Vec3::Ones(), {.stroke = soft, .width = 1.2});
    draw_quads(svg, view, quads, colour_of_fan, 0.75);
    draw_crossings(svg, view, fans.mask);
    for (const DrawnQuad& q : quads) {
        const std::string& colour = colours_of(colour_of_fan[q.table.fan]).line;
        draw_face_vertex(svg, view.at(q.corners[1]), colour);
        draw_face_vertex(svg, view.at(q.corners[3]), colour);
    }
    for (const DrawnQuad& q : quads)
        draw_centre_vertex(svg, view.at(q.corners[2]),
                           split ? colours_of(colour_of_fan[q.table.fan]).line : red);
}

}  // namespace

Svg draw_fans() {
    Svg svg(860, 280);
    double x = 24;
    for (const std::size_t count : {2U, 3U}) {
        const FanCase fans = fewest_cuts_with(count);
        const std::vector<DrawnQuad> quads = quads_of(fans);
        for (const bool split : {false, true}) {
            const CellView view{{{x, 190}, 122}};
            draw_panel(svg, view, fans, quads, split);
            const double middle = view.panel.at({0.67, 0})[0];
            const std::string number = count == 2 ? "two" : "three";
            svg.text({middle, 226}, split ? "split: " + number + " centre vertices"
                                          : "mask " + std::to_string(fans.mask) + ": " + number + " fans,");
            svg.text({middle, 244}, split ? "one for each fan" : "one centre vertex");
            x += 212;
        }
    }
    svg.text({430, 268}, "Quads of one component of the cell; colours: fans.", Anchor::middle, 12, "#555555");
    return svg;
}

}  // namespace splitcubes::app::figures
