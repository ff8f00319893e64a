#include "drawing.h"
#include "figures.h"

#include <splitcubes/core/random.h>
#include <splitcubes/splitting/placement.h>
#include <splitcubes/splitting/table.h>

#include <array>
#include <cmath>

namespace splitcubes::app::figures {

namespace {

using namespace splitting;

// Draws the lower z face of a single cell.
constexpr int face = 4;

struct FaceHit {
    int ring_edge;
    double parameter;
    Vec2 normal;
};

struct Example {
    const char* words;
    std::vector<FaceHit> hits;
};

std::vector<Example> examples() {
    return {{"no edge cut", {}},
            {"one edge", {{0, 0.55, {1, -0.25}}}},
            {"two neighbours", {{0, 0.62, {0.8, 0.6}}, {3, 0.56, {0.6, 0.8}}}},
            {"two opposite", {{0, 0.38, {1, 0.2}}, {2, 0.62, {1, -0.2}}}},
            {"three", {{0, 0.42, {1, 0.08}}, {2, 0.47, {1, -0.05}}, {1, 0.6, {0.15, 1}}}},
            {"four", {{0, 0.6, {1, 0.2}}, {1, 0.6, {-0.2, 1}}, {2, 0.4, {1, 0.2}}, {3, 0.4, {-0.2, 1}}}}};
}

unsigned mask_of(const Example& example) {
    unsigned mask = 0;
    for (const FaceHit& hit : example.hits) mask |= 1U << hit.ring_edge;
    return mask;
}

NodeGrid grid_around_faces(const Example& example) {
    NodeGrid grid = solid_grid(Vec3i::Constant(2));
    for (const FaceHit& hit : example.hits)
        grid.cut(cell_edge(Vec3i::Zero(), face_edge(face, hit.ring_edge)), hit.parameter,
                 Vec3(hit.normal[0], hit.normal[1], 0), Origin::cut, 0);
    return grid;
}

// Moves each node away from its cut edges. A component that is separated from others moves rigidly and
// rotates a little; one that is connected around the end of a cut bends.
std::array<geometry::Frame, 4> ring_frames(unsigned mask, Random& random) {
    const FaceConfiguration& configuration = Table::get().face(mask);
    std::array<Vec3, 4> shift;
    for (int k = 0; k < 4; ++k) {
        const auto away = [&](int other) {
            const int a = face_corner(face, k), b = face_corner(face, other % 4);
            return Vec3(corner_bit(a, 0) - corner_bit(b, 0), corner_bit(a, 1) - corner_bit(b, 1), 0);
        };
        Vec3& s = shift[static_cast<std::size_t>(k)] = Vec3::Zero();
        if (mask >> k & 1U) s += 0.14 * away(k + 1);
        if (mask >> ((k + 3) % 4) & 1U) s += 0.14 * away(k + 3);
    }
    std::array<geometry::Frame, 4> frames;
    for (std::size_t name = 0; name < 4; ++name) {
        const double angle = random.uniform(-0.12, 0.12);
        const Mat3 turn = Eigen::AngleAxisd(angle, Vec3::UnitZ()).toRotationMatrix();
        Vec3 mean_shift = Vec3::Zero(), middle = Vec3::Zero();
        int count = 0;
        for (std::size_t k = 0; k < 4; ++k) {
            if (configuration.instance[k] != name) continue;
            mean_shift += shift[k];
            middle += corner_node(Vec3i::Zero(), face_corner(face, static_cast<int>(k))).cast<double>();
            ++count;
        }
        for (std::size_t k = 0; k < 4; ++k) {
            if (configuration.instance[k] != name) continue;
            const Vec3 node =
                corner_node(Vec3i::Zero(), face_corner(face, static_cast<int>(k))).cast<double>();
            if (configuration.cut_count < 2)
                frames[k].position = node + shift[k];
            else
                frames[k] = {middle / count + mean_shift / count + turn * (node - middle / count), turn};
        }
    }
    return frames;
}

void draw_cut_edges(Svg& svg, const Panel& panel, const Example& example) {
    for (const FaceHit& hit : example.hits) {
        const FaceCrossing crossing =
            face_crossing(hit.ring_edge, hit.parameter, hit.normal[0], hit.normal[1]);
        const Vec2 tangent(-crossing.normal[1], crossing.normal[0]);
        svg.line(panel.at(crossing.point - 0.17 * tangent), panel.at(crossing.point + 0.17 * tangent),
                 {.stroke = red, .width = 1.5});
        draw_crossing(svg, panel.at(crossing.point));
    }
}

// Draws all patches of the face; frames: of its ring corners.
void draw_face(Svg& svg, const Panel& panel, const Example& example,
               const std::array<geometry::Frame, 4>& frames, bool at_rest) {
    const NodeGrid grid = grid_around_faces(example);
    const Surface surface(grid);
    const auto frame_of = [&](const Vec3i& node) {
        for (int k = 0; k < 4; ++k)
            if (corner_node(Vec3i::Zero(), face_corner(face, k)) == node)
                return frames[static_cast<std::size_t>(k)];
        return geometry::Frame{grid.rest().node_position(node)};
    };
    std::vector<geometry::Frame> node_frames;
    for (const Vec3i& node : surface.nodes()) node_frames.push_back(frame_of(node));
    std::vector<Vec3> positions, normals;
    deform(surface, grid.rest(), node_frames, positions, normals, Parallel(1));
    const auto position_of = [&](const Patch::Point& p) {
        const Vec3 x =
            p.vertex < 0 ? frame_of(p.node).position : positions[static_cast<std::size_t>(p.vertex)];
        return panel.at({x[0], x[1]});
    };
    const std::vector<Patch> patches = patches_of_layer(grid, surface, 0);
    for (std::size_t k = 0; k < patches.size(); ++k) {
        std::vector<Vec2> outline;
        for (const Patch::Point& p : patches[k].outline) outline.push_back(position_of(p));
        svg.polygon(outline, {.fill = colours_of(k).fill, .stroke = colours_of(k).line});
    }
    if (at_rest) draw_cut_edges(svg, panel, example);
    for (std::size_t k = 0; k < patches.size(); ++k)
        for (const Patch::Point& p : patches[k].outline) {
            const std::string& colour = colours_of(k).line;
            if (p.vertex < 0)
                draw_node(svg, position_of(p), colour);
            else if (surface.vertices()[static_cast<std::size_t>(p.vertex)].kind == VertexKind::face)
                draw_face_vertex(svg, position_of(p), at_rest ? ink : colour);
            else if (!at_rest)
                draw_edge_vertex(svg, position_of(p), colour);
        }
}

void draw_face_legend(Svg& svg, double y) {
    const double x = 40;
    draw_node(svg, {x, y}, colours_of(0).line);
    svg.text({x + 12, y}, "node, coloured by component", Anchor::start);
    draw_crossing(svg, {x + 242, y});
    svg.line({x + 242, y - 12}, {x + 242, y + 12}, {.stroke = red});
    svg.text({x + 256, y}, "crossing and tangent", Anchor::start);
    draw_edge_vertex(svg, {x + 424, y}, colours_of(0).line);
    svg.text({x + 436, y}, "edge vertex, one an end", Anchor::start);
    draw_face_vertex(svg, {x + 622, y}, colours_of(0).line);
    svg.text({x + 635, y}, "face vertex, one a component", Anchor::start);
}

}  // namespace

Svg draw_faces() {
    constexpr double pitch = 158, scale = 92;
    Svg svg(960, 400);
    Random random(5);
    double x = 40;
    for (const Example& example : examples()) {
        const unsigned mask = mask_of(example);
        const char letter = static_cast<char>('A' + static_cast<int>(Table::get().face(mask).kind));
        svg.text({x + scale / 2, 22}, std::string(1, letter), Anchor::middle, 17, ink, true);
        svg.text({x + scale / 2, 42}, example.words);
        std::array<geometry::Frame, 4> rest;
        for (int k = 0; k < 4; ++k)
            rest[static_cast<std::size_t>(k)].position =
                corner_node(Vec3i::Zero(), face_corner(face, k)).cast<double>();
        draw_face(svg, {{x, 170}, scale}, example, rest, true);
        draw_face(svg, {{x, 330}, scale}, example, ring_frames(mask, random), false);
        x += pitch;
    }
    draw_face_legend(svg, 378);
    return svg;
}

}  // namespace splitcubes::app::figures
