#include <splitcubes/splitting/placement.h>
#include <splitcubes/splitting/table.h>

#include "drawing.h"
#include "figures.h"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace splitcubes::app::figures {

namespace {

using namespace splitting;

struct Hit {
    int ring_edge;
    double parameter;
    double tangent_degrees;  // of the sheet's trace in the face
    std::int32_t cut = 0;
};

// A face with crossings.
struct FaceCase {
    unsigned mask = 0;
    std::array<FaceCrossing, 4> crossings;

    explicit FaceCase(const std::vector<Hit>& hits) {
        for (const Hit& hit : hits) {
            const double angle = hit.tangent_degrees * std::numbers::pi / 180;
            mask |= 1U << hit.ring_edge;
            crossings[static_cast<std::size_t>(hit.ring_edge)] =
                face_crossing(hit.ring_edge, hit.parameter, -std::sin(angle), std::cos(angle), hit.cut);
        }
    }
    const FaceCrossing& at(int ring_edge) const { return crossings[static_cast<std::size_t>(ring_edge)]; }
    Vec2 vertex() const { return place_face_vertex(mask, crossings).point; }
};

Vec2 tangent_of(const FaceCrossing& c) {
    return {-c.normal[1], c.normal[0]};
}

// Returns the tangent, oriented from the crossing into the face towards its middle.
Vec2 inward_tangent(const FaceCrossing& c) {
    const Vec2 t = tangent_of(c);
    return t.dot(Vec2(0.5, 0.5) - c.point) < 0 ? Vec2(-t) : t;
}

Vec2 where_tangents_meet(const FaceCrossing& a, const FaceCrossing& b) {
    const Vec2 t = tangent_of(a);
    return a.point + b.normal.dot(b.point - a.point) / b.normal.dot(t) * t;
}

const Style construction{.stroke = red, .width = 1.2, .dashes = "4 3"};
const Style old_line{.stroke = "#2a7a36", .width = 2};
const Style result_line{.stroke = "#1f5fa0", .width = 2.5};

void draw_square(Svg& svg, const Panel& panel, double margin, const Style& style) {
    const double low = -margin, high = 1 + margin;
    const std::array<Vec2, 4> square{panel.at({low, low}), panel.at({high, low}), panel.at({high, high}),
                                     panel.at({low, high})};
    svg.polygon(square, style);
}

void draw_frame(Svg& svg, const Panel& panel, const std::string& title, const std::string& words) {
    draw_square(svg, panel, 0, {.stroke = soft, .width = 1.5});
    for (int k = 0; k < 4; ++k)
        draw_node(svg, panel.at({static_cast<double>(k & 1), static_cast<double>(k >> 1)}), soft);
    const double x = panel.at({0.5, 0})[0];
    svg.text({x, panel.at({0, 1})[1] - 62}, title, Anchor::middle, 13, ink, true);
    svg.text({x, panel.at({0, 1})[1] - 45}, words, Anchor::middle, 12, "#555555");
}

void draw_result(Svg& svg, const Panel& panel, const FaceCase& face) {
    const Vec2 vertex = face.vertex();
    for (int k = 0; k < 4; ++k) {
        if (!(face.mask >> k & 1U)) continue;
        svg.line(panel.at(face.at(k).point), panel.at(vertex), result_line);
    }
    for (int k = 0; k < 4; ++k)
        if (face.mask >> k & 1U) draw_crossing(svg, panel.at(face.at(k).point));
    draw_face_vertex(svg, panel.at(vertex), ink);
}

// Draws the tangents of all crossings, `reach` long to both sides.
void draw_tangents(Svg& svg, const Panel& panel, const FaceCase& face, double back, double reach) {
    for (int k = 0; k < 4; ++k) {
        if (!(face.mask >> k & 1U)) continue;
        const Vec2 t = inward_tangent(face.at(k));
        svg.line(panel.at(face.at(k).point - back * t), panel.at(face.at(k).point + reach * t), construction);
    }
}

void draw_single(Svg& svg, const Panel& panel) {
    const FaceCase face({{0, 0.35, 62}});
    draw_frame(svg, panel, "one crossing", "half way to where it leaves");
    // The vertex is the midpoint, so the tangent leaves the face at twice its offset.
    const Vec2 start = face.at(0).point, leave = start + 2 * (face.vertex() - start);
    svg.line(panel.at(start), panel.at(leave), construction);
    svg.circle(panel.at(leave), 2.5, {.fill = red});
    draw_result(svg, panel, face);
}

void draw_smooth_pair(Svg& svg, const Panel& panel) {
    const FaceCase face({{0, 0.3, 51}, {2, 0.64, 76}});
    draw_frame(svg, panel, "smooth pair", "middle of the Hermite arc");
    const FaceCrossing &a = face.at(0), &b = face.at(2);
    const Vec2 chord = b.point - a.point;
    Vec2 t0 = tangent_of(a), t1 = tangent_of(b);
    if (t0.dot(chord) < 0) t0 = -t0;
    if (t1.dot(chord) < 0) t1 = -t1;
    std::vector<Vec2> arc;
    for (int k = 0; k <= 24; ++k) {
        const double s = k / 24.0, r = 1 - s;
        const Vec2 p = r * r * (1 + 2 * s) * a.point + s * s * (3 - 2 * s) * b.point +
                       chord.norm() * (s * r * r * t0 - s * s * r * t1);
        arc.push_back(panel.at(p));
    }
    svg.polyline(arc, {.stroke = "#2a7a36", .width = 2});
    svg.arrow(panel.at(a.point), panel.at(a.point + 0.28 * t0), {.stroke = red, .width = 1.2});
    svg.arrow(panel.at(b.point), panel.at(b.point + 0.28 * t1), {.stroke = red, .width = 1.2});
    draw_result(svg, panel, face);
}

void draw_sharp_pair(Svg& svg, const Panel& panel) {
    const FaceCase face({{0, 0.62, 105}, {3, 0.68, -12}});
    draw_frame(svg, panel, "sharp pair", "where the tangents meet");
    draw_tangents(svg, panel, face, 0, 0.85);
    draw_result(svg, panel, face);
}

void draw_least_squares(Svg& svg, const Panel& panel, const std::string& title,
                        const std::vector<Hit>& hits) {
    const FaceCase face(hits);
    draw_frame(svg, panel, title, "nearest to all tangents");
    draw_tangents(svg, panel, face, 0, 0.85);
    draw_result(svg, panel, face);
}

void draw_pull_back(Svg& svg, const Panel& panel) {
    const FaceCase face({{0, 0.56, -78}, {1, 0.36, 70}});
    draw_frame(svg, panel, "too far outside", "clamped to the wider square");
    draw_square(svg, panel, 0.25, {.stroke = faint, .width = 1.5, .dashes = "2 3"});
    const FaceCrossing &a = face.at(0), &b = face.at(1);
    const Vec2 mean = (a.point + b.point) / 2, meet = where_tangents_meet(a, b);
    svg.line(panel.at(a.point), panel.at(meet), construction);
    svg.line(panel.at(b.point), panel.at(meet), construction);
    svg.line(panel.at(mean), panel.at(meet), {.stroke = "#2a7a36", .width = 1.2});
    svg.circle(panel.at(mean), 3, {.fill = "#2a7a36"});
    svg.circle(panel.at(meet), 2.5, {.fill = red});
    draw_result(svg, panel, face);
}

void draw_slide(Svg& svg, const Panel& panel) {
    const FaceCase face({{1, 0.68, 177, -1}, {3, 0.62, 6, -1}, {0, 0.45, 62, 0}});
    draw_frame(svg, panel, "boundary and cut", "slides along the boundary to the cut");
    std::array<FaceCrossing, 4> crossings = face.crossings;
    const Vec2 alone = place_face_vertex(face.mask & ~1U, crossings).point;
    const FaceCrossing& later = face.at(0);
    svg.line(panel.at(later.point), panel.at(later.point + 0.95 * inward_tangent(later)), construction);
    svg.line(panel.at(face.at(3).point), panel.at(alone), old_line);
    svg.line(panel.at(face.at(1).point), panel.at(alone), old_line);
    svg.circle(panel.at(alone), 3, {.fill = "#2a7a36"});
    draw_result(svg, panel, face);
    svg.text(panel.at({0.22, 0.78}), "boundary", Anchor::middle, 12, "#555555");
    svg.text(panel.at({0.72, 0.24}), "cut", Anchor::middle, 12, "#555555");
}

// A ball below the cell whose top reaches into it, and its crossings.
const Vec3 ball(0.5, 0.5, -2.75);
constexpr double ball_radius = 3.3;

NodeGrid grid_over_ball() {
    NodeGrid grid = solid_grid(Vec3i::Constant(2));
    for (int k = 0; k < 4; ++k) {
        const Vec3i node(k & 1, k >> 1, 0);
        Vec3 at = node.cast<double>();
        at[2] = ball[2] + std::sqrt(ball_radius * ball_radius - (at - ball).head<2>().squaredNorm());
        grid.cut({node, 2}, at[2], at - ball, Origin::cut, 0);
    }
    return grid;
}

// Draws the lift of the centre in the plane x = 0.5, heights exaggerated five times.
void draw_lift(Svg& svg, const Panel& panel) {
    draw_frame(svg, panel, "smooth centre", "lifted from the mean of the faces");
    svg.text(panel.at({0.5, 0.12}), "heights x 5", Anchor::middle, 12, "#555555");
    const auto at = [&](double y, double z) { return panel.at({y, 0.55 + 5 * (z - 0.5)}); };
    std::vector<Vec2> circle;
    for (int k = 0; k <= 30; ++k) {
        const double y = k / 30.0, across = y - ball[1];
        circle.push_back(at(y, ball[2] + std::sqrt(ball_radius * ball_radius - across * across)));
    }
    svg.polyline(circle, {.stroke = "#2a7a36", .width = 2});
    const Surface surface(grid_over_ball());
    // Both instances of a face vertex coincide, so their mean is that of the faces.
    std::vector<Vec3> faces;
    Vec3 centre = Vec3::Zero(), mean = Vec3::Zero();
    for (const SurfaceVertex& v : surface.vertices()) {
        if (v.kind == VertexKind::centre) centre = v.rest;
        if (v.kind == VertexKind::face) faces.push_back(v.rest);
    }
    for (const Vec3& f : faces) mean += f / static_cast<double>(faces.size());
    for (const Vec3& f : faces) {
        if (f[1] > 0 && f[1] < 1) continue;
        svg.line(at(f[1], f[2]), at(mean[1], mean[2]), construction);
        svg.line(at(f[1], f[2]), at(centre[1], centre[2]), result_line);
        draw_face_vertex(svg, at(f[1], f[2]), ink);
    }
    svg.circle(at(mean[1], mean[2]), 3, {.fill = red});
    draw_centre_vertex(svg, at(centre[1], centre[2]), ink);
}

void draw_placement_legend(Svg& svg, double y) {
    draw_crossing(svg, {44, y});
    svg.text({56, y}, "crossing", Anchor::start);
    svg.line({140, y}, {166, y}, construction);
    svg.text({174, y}, "tangent", Anchor::start);
    svg.line({252, y}, {278, y}, {.stroke = "#2a7a36", .width = 2});
    svg.text({286, y}, "arc, boundary alone, clamping, ball", Anchor::start);
    svg.line({530, y}, {556, y}, result_line);
    svg.text({564, y}, "surface", Anchor::start);
    draw_face_vertex(svg, {646, y}, ink);
    svg.text({658, y}, "face vertex", Anchor::start);
    draw_centre_vertex(svg, {762, y}, ink);
    svg.text({776, y}, "centre vertex", Anchor::start);
}

}  // namespace

Svg draw_placement() {
    Svg svg(904, 560);
    constexpr double scale = 116;
    const auto panel = [](int column, int row) {
        return Panel{{54 + 226.0 * column, 200 + 252.0 * row}, scale};
    };
    draw_single(svg, panel(0, 0));
    draw_smooth_pair(svg, panel(1, 0));
    draw_sharp_pair(svg, panel(2, 0));
    draw_least_squares(svg, panel(3, 0), "three crossings", {{0, 0.4, 95}, {2, 0.52, -80}, {1, 0.62, 187}});
    draw_least_squares(svg, panel(0, 1), "four crossings",
                       {{0, 0.62, 100}, {2, 0.4, -84}, {1, 0.6, 186}, {3, 0.42, 10}});
    draw_pull_back(svg, panel(1, 1));
    draw_slide(svg, panel(2, 1));
    draw_lift(svg, panel(3, 1));
    draw_placement_legend(svg, 536);
    return svg;
}

}  // namespace splitcubes::app::figures
