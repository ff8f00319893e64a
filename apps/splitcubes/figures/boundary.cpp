#include <splitcubes/geometry/shapes.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/solidify.h>

#include "drawing.h"
#include "figures.h"

#include <algorithm>
#include <array>
#include <vector>

namespace splitcubes::app::figures {

namespace {

using namespace splitting;

// A tilted bar along z, intact and cut by a slanted plane along z.
struct CutBar {
    NodeGrid whole, cut;
    int level = 0;  // layer of grid faces that is drawn
};

CutBar make_bar() {
    geometry::TriangleMesh mesh = geometry::make_box(Vec3(9.2, 4.6, 2));
    const Mat3 turn = Eigen::AngleAxisd(0.21, Vec3::UnitZ()).toRotationMatrix();
    for (Vec3& p : mesh.positions) p = turn * p;
    SolidifyReport report;
    CutBar bar;
    bar.whole = solidify(mesh, geometry::grid_around(mesh.bounds(), 1), report, Parallel(1));
    bar.cut = bar.whole;
    cut_with_sheet(bar.cut, geometry::make_plane_sheet(Vec3(0.62, 0, 0), Vec3(1, 0.42, 0), 12), 0);
    bar.level = bar.whole.rest().node_count[2] / 2;
    return bar;
}

// The faces of one layer of a grid, at rest or displaced.
class Layer {
  public:
    // frames: one per piece.
    Layer(const NodeGrid& grid, int level, const std::vector<geometry::Frame>& frames)
        : grid_(&grid),
          surface_(grid),
          pieces_(grid),
          frames_(frames),
          patches_(patches_of_layer(grid, surface_, level)) {
        std::vector<geometry::Frame> node_frames;
        for (const Vec3i& node : surface_.nodes()) node_frames.push_back(frame_of(node));
        std::vector<Vec3> normals;
        deform(surface_, grid.rest(), node_frames, positions_, normals, Parallel(1));
    }

    // Returns the faces at most `reach` faces away.
    Layer near(const Vec3i& face, int reach) const {
        Layer out = *this;
        std::erase_if(out.patches_,
                      [&](const Patch& patch) { return (patch.face - face).cwiseAbs().maxCoeff() > reach; });
        return out;
    }

    const NodeGrid& grid() const { return *grid_; }
    const std::vector<Patch>& patches() const { return patches_; }
    Vec2 position_of(const Patch::Point& p) const {
        const Vec3 x =
            p.vertex < 0 ? frame_of(p.node).position : positions_[static_cast<std::size_t>(p.vertex)];
        return {x[0], x[1]};
    }
    std::size_t piece_of(const Patch& patch) const {
        return static_cast<std::size_t>(pieces_.piece_of(*grid_, patch.outline.front().node));
    }

  private:
    geometry::Frame frame_of(const Vec3i& node) const {
        const geometry::Frame& piece =
            frames_[static_cast<std::size_t>(std::max(0, pieces_.piece_of(*grid_, node)))];
        const Vec3 rest = grid_->rest().node_position(node);
        return {piece.position + piece.jacobian * rest, piece.jacobian};
    }

    const NodeGrid* grid_;
    Surface surface_;
    Pieces pieces_;
    std::vector<geometry::Frame> frames_;
    std::vector<Patch> patches_;
    std::vector<Vec3> positions_;
};

void fill_patches(Svg& svg, const Panel& panel, const Layer& layer) {
    for (const Patch& patch : layer.patches()) {
        std::vector<Vec2> outline;
        for (const Patch::Point& p : patch.outline) outline.push_back(panel.at(layer.position_of(p)));
        const std::string& fill = colours_of(layer.piece_of(patch)).fill;
        svg.polygon(outline, {.fill = fill, .stroke = fill, .width = 0.8});
    }
}

// Draws the surface in the layer: lines from the edge vertices to the face vertices.
void draw_surface(Svg& svg, const Panel& panel, const Layer& layer, const Style& style) {
    for (const Patch& patch : layer.patches()) {
        if (patch.whole) continue;
        const std::array<Vec2, 3> line{panel.at(layer.position_of(patch.outline[1])),
                                       panel.at(layer.position_of(patch.outline[0])),
                                       panel.at(layer.position_of(patch.outline.back()))};
        svg.polyline(line, style);
    }
}

void draw_grid(Svg& svg, const Panel& panel, const RestGrid& rest, const Vec2& low, const Vec2& high) {
    for (int axis = 0; axis < 2; ++axis)
        for (int k = 0; k < rest.node_count[axis]; ++k) {
            const double at = rest.origin[axis] + k * rest.cell_size;
            if (at < low[axis] - 1e-9 || at > high[axis] + 1e-9) continue;
            Vec2 a = low, b = high;
            a[axis] = b[axis] = at;
            svg.line(panel.at(a), panel.at(b), {.stroke = faint, .width = 1});
        }
}

// Returns the crossed ring edges of a face with their origin.
std::vector<Crossing> crossings_of(const NodeGrid& grid, const Vec3i& face) {
    std::vector<Crossing> out;
    for (int axis = 0; axis < 2; ++axis)
        for (int side = 0; side < 2; ++side) {
            Vec3i node = face;
            node[1 - axis] += side;
            const std::int32_t slot = grid.slot({node, axis});
            if (slot >= 0) out.push_back(grid.crossing(slot));
        }
    return out;
}

bool has_both(const std::vector<Crossing>& crossings) {
    const auto is_cut = [](const Crossing& c) { return c.origin == Origin::cut; };
    return std::any_of(crossings.begin(), crossings.end(), is_cut) &&
           !std::all_of(crossings.begin(), crossings.end(), is_cut);
}

// Returns the highest face in which the cut meets the boundary.
Vec3i upper_meeting(const Layer& layer) {
    Vec3i best(0, -1, 0);
    for (const Patch& patch : layer.patches())
        if (patch.face[1] > best[1] && has_both(crossings_of(layer.grid(), patch.face))) best = patch.face;
    return best;
}

void draw_boundary_marks(Svg& svg, const Panel& panel, const Layer& layer) {
    for (const Patch& patch : layer.patches()) {
        for (const Crossing& c : crossings_of(layer.grid(), patch.face)) {
            const Vec3 at = layer.grid().crossing_position(c);
            draw_crossing(svg, panel.at({at[0], at[1]}));
        }
        for (const Patch::Point& p : patch.outline)
            if (p.vertex < 0)
                draw_node(svg, panel.at(layer.position_of(p)), colours_of(layer.piece_of(patch)).line);
    }
    for (const Patch& patch : layer.patches())
        if (!patch.whole) draw_face_vertex(svg, panel.at(layer.position_of(patch.outline[0])), ink);
}

const Style old_boundary{.stroke = "#f5b06a", .width = 7};
const Style surface_line{.stroke = ink, .width = 1.8};

void draw_zoom(Svg& svg, const Panel& panel, const Layer& old_layer, const Layer& layer, const Vec3i& face,
               const Vec2& low, const Vec2& high) {
    const Layer close = layer.near(face, 1);
    fill_patches(svg, panel, close);
    draw_grid(svg, panel, layer.grid().rest(), low, high);
    draw_surface(svg, panel, old_layer.near(face, 1), old_boundary);
    draw_surface(svg, panel, close, surface_line);
    draw_boundary_marks(svg, panel, close);
}

void draw_boundary_legend(Svg& svg, double y) {
    svg.line({40, y}, {70, y}, old_boundary);
    svg.text({80, y}, "boundary before the cut", Anchor::start);
    svg.line({240, y}, {270, y}, surface_line);
    svg.text({280, y}, "surface after it", Anchor::start);
    draw_node(svg, {424, y}, colours_of(0).line);
    svg.text({436, y}, "node of a piece", Anchor::start);
    draw_crossing(svg, {574, y});
    svg.text({586, y}, "crossing", Anchor::start);
    draw_face_vertex(svg, {676, y}, ink);
    svg.text({688, y}, "face vertex, for each piece", Anchor::start);
}

}  // namespace

Svg draw_boundary() {
    const CutBar bar = make_bar();
    const std::vector<geometry::Frame> still(2);
    std::vector<geometry::Frame> apart(2);
    for (std::size_t k = 0; k < 2; ++k) {
        const double side = k == 0 ? -1 : 1;
        apart[k].position = side * Vec3(0.55, 0.1, 0);
        apart[k].jacobian = Eigen::AngleAxisd(-0.09 * side, Vec3::UnitZ()).toRotationMatrix();
    }
    const Layer old_layer(bar.whole, bar.level, still), layer(bar.cut, bar.level, still),
        moved(bar.cut, bar.level, apart);
    const RestGrid& rest = bar.cut.rest();
    const Vec3 last = rest.node_position(rest.node_count - Vec3i::Ones());

    Svg svg(1000, 330);
    const Panel whole{{190, 165}, 27}, separated{{812, 165}, 27};
    fill_patches(svg, whole, layer);
    draw_grid(svg, whole, rest, {rest.origin[0], rest.origin[1]}, {last[0], last[1]});
    draw_surface(svg, whole, old_layer, old_boundary);
    draw_surface(svg, whole, layer, surface_line);

    const Vec3i face = upper_meeting(layer);
    const Vec3 corner = rest.node_position(face - Vec3i(1, 1, 0));
    const Vec2 low(corner[0], corner[1]), high = low + Vec2(3, 3);
    const std::array<Vec2, 4> window{whole.at(low), whole.at({high[0], low[1]}), whole.at(high),
                                     whole.at({low[0], high[1]})};
    svg.polygon(window, {.stroke = red, .width = 1.4, .dashes = "4 3"});
    constexpr double zoom = 72;
    const Panel close{Vec2(386, 276) - zoom * Vec2(low[0], -low[1]), zoom};
    draw_zoom(svg, close, old_layer, layer, face, low, high);

    fill_patches(svg, separated, moved);
    draw_surface(svg, separated, moved, surface_line);
    svg.text({190, 26}, "at rest", Anchor::middle, 13, ink, true);
    svg.text({494, 26}, "where the cut meets the boundary", Anchor::middle, 13, ink, true);
    svg.text({812, 26}, "the pieces apart", Anchor::middle, 13, ink, true);
    draw_boundary_legend(svg, 308);
    return svg;
}

}  // namespace splitcubes::app::figures
