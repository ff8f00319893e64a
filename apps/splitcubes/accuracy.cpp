#include "accuracy.h"

#include <splitcubes/core/random.h>
#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/solidify.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace splitcubes::app {

using geometry::RestGrid;
using geometry::SurfaceMesh;
using geometry::TriangleMesh;

void Spread::add(double deviation) {
    max = std::max(max, std::abs(deviation));
    sum_of_squares += deviation * deviation;
    ++count;
}

double Spread::rms() const {
    return count == 0 ? 0 : std::sqrt(sum_of_squares / static_cast<double>(count));
}

double Opposing::share() const {
    return triangles == 0 ? 0 : static_cast<double>(opposing) / static_cast<double>(triangles);
}

void Opposing::add(const Opposing& other) {
    triangles += other.triangles;
    opposing += other.opposing;
    area += other.area;
    opposing_area += other.opposing_area;
    largest = std::max(largest, other.largest);
}

double Opposing::area_share() const {
    return area == 0 ? 0 : opposing_area / area;
}

namespace {

// Position and orientation of a shape that is centred at the origin.
struct Pose {
    Quat rotation = Quat::Identity();
    Vec3 offset = Vec3::Zero();

    Vec3 own(const Vec3& p) const { return rotation.conjugate() * (p - offset); }
};

Vec3 random_direction(Random& random) {
    const double z = random.uniform(-1, 1), angle = random.uniform(0, 2 * std::numbers::pi);
    const double ring = std::sqrt(1 - z * z);
    return {ring * std::cos(angle), ring * std::sin(angle), z};
}

// Returns a random pose in a grid of unit cells with nodes at integer coordinates.
Pose random_pose(Random& random) {
    Pose out;
    const Vec3 axis = random_direction(random);
    out.rotation = Eigen::AngleAxisd(random.uniform(0, 2 * std::numbers::pi), axis);
    for (int k = 0; k < 3; ++k) out.offset[k] = random.uniform(0, 1);
    return out;
}

TriangleMesh placed(TriangleMesh mesh, const Pose& pose) {
    for (Vec3& p : mesh.positions) p = pose.rotation * p + pose.offset;
    return mesh;
}

RestGrid unit_grid(const TriangleMesh& mesh) {
    const geometry::Box box = mesh.bounds();
    RestGrid rest;
    rest.cell_size = 1;
    rest.origin = box.min.array().floor() - 2;
    rest.node_count = (box.max - rest.origin).array().ceil().cast<int>() + 3;
    return rest;
}

// An edge vertex that was moved away from a node does not lie at its crossing.
bool is_moved(const splitting::Crossing& crossing) {
    return crossing.parameter != crossing.hit;
}

using FaceCorners = std::array<Vec3, 3>;

// Counts the triangles for which `wanted(crossing, corners)` holds.
template <class Wanted>
Opposing count_opposing(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                        const Wanted& wanted) {
    Opposing out;
    const double face = grid.rest().cell_size * grid.rest().cell_size;
    for (const splitting::SurfaceCell& cell : surface.cells())
        for (const splitting::SurfaceQuad& quad : surface.quads(cell))
            for (const std::size_t second : {1U, 2U}) {
                const auto at = [&](std::size_t k) -> const splitting::SurfaceVertex& {
                    return surface.vertices()[quad.vertices[k]];
                };
                const FaceCorners corners = {at(0).rest, at(second).rest, at(second + 1).rest};
                const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
                const double area = 0.5 * normal.norm() / face;
                if (area < 1e-9 || !wanted(grid.crossing(quad.crossing), corners)) continue;
                ++out.triangles;
                out.area += area;
                // An edge vertex's normal is that of its crossing, oriented outward.
                const Vec3f& outward = at(0).normal;
                if (!(normal.dot(outward.cast<double>()) < 0)) continue;
                ++out.opposing;
                out.opposing_area += area;
                out.largest = std::max(out.largest, area);
            }
    return out;
}

bool any_triangle(const splitting::Crossing& /*crossing*/, const FaceCorners& /*corners*/) {
    return true;
}

struct Solid {
    explicit Solid(splitting::NodeGrid made) : grid(std::move(made)) {}
    Solid(const TriangleMesh& mesh, const RestGrid& rest, const Parallel& parallel)
        : grid(splitting::solidify(mesh, rest, report, parallel)) {}
    SurfaceMesh extracted() const {
        return splitting::extract(grid, splitting::Surface(grid), splitting::Pieces(grid));
    }
    Opposing opposing() const { return count_opposing(grid, splitting::Surface(grid), any_triangle); }

    splitting::SolidifyReport report;
    splitting::NodeGrid grid;
};

double off_box(const Vec3& p, const Vec3& half) {
    const Vec3 beyond = p.cwiseAbs() - half;
    return beyond.cwiseMax(0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

constexpr double ring_ratio = 2;  // ring radius over tube radius of the torus

// A sphere or a torus; lengths in cells.
struct SmoothShape {
    bool torus = false;
    double radius = 0;  // of the sphere or the tube
    Pose pose;

    double ring() const { return torus ? ring_ratio * radius : 0; }
    double volume() const {
        const double pi = std::numbers::pi;
        return torus ? 2 * pi * pi * ring() * radius * radius : 4 * pi / 3 * radius * radius * radius;
    }
    // Returns the offset from the sphere's centre or from the nearest point of the torus's centre line.
    Vec3 from_middle(const Vec3& p) const {
        const Vec3 own = pose.own(p), flat(own[0], own[1], 0);
        return pose.rotation * Vec3(own - ring() * flat.stableNormalized());
    }
    double off(const Vec3& p) const { return from_middle(p).norm() - radius; }
    Vec3 normal(const Vec3& p) const { return from_middle(p).normalized(); }
};

// Returns the parameter at which the shape crosses the edge from a to a + axis, one end of which is inside.
double crossing_of(const SmoothShape& shape, const Vec3& a, int axis) {
    double low = 0, high = 1;
    const bool begins_inside = shape.off(a) < 0;
    for (int k = 0; k < 50; ++k) {
        const double middle = 0.5 * (low + high);
        ((shape.off(a + middle * Vec3::Unit(axis)) < 0) == begins_inside ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

// Returns the grid with crossings of the exact shape. Triangles of an input mesh would add errors of their
// own, first in the normals.
splitting::NodeGrid grid_around(const SmoothShape& shape) {
    RestGrid rest;
    const double reach = shape.radius + shape.ring() + 3;
    rest.origin = (shape.pose.offset.array() - reach).floor();
    rest.node_count = Vec3i::Constant(static_cast<int>(2 * reach) + 2);
    splitting::NodeGrid grid(rest);
    const auto inside = [&](const Vec3i& node) { return shape.off(rest.node_position(node)) < 0; };
    const Vec3i n = rest.node_count;
    for (int z = 0; z < n[2]; ++z)
        for (int y = 0; y < n[1]; ++y)
            for (int x = 0; x < n[0]; ++x)
                if (inside({x, y, z})) grid.set_inside_row(y, z, x, x + 1);
    for (int z = 0; z + 1 < n[2]; ++z)
        for (int y = 0; y + 1 < n[1]; ++y)
            for (int x = 0; x + 1 < n[0]; ++x)
                for (int axis = 0; axis < 3; ++axis) {
                    const splitting::GridEdge edge{{x, y, z}, axis};
                    if (grid.inside(edge.node) == grid.inside(edge.upper())) continue;
                    const Vec3 a = rest.node_position(edge.node);
                    const double at = crossing_of(shape, a, axis);
                    grid.cut(edge, at, shape.normal(a + at * Vec3::Unit(axis)), geometry::Origin::boundary,
                             -1);
                }
    return grid;
}

SmoothRow measure_smooth(bool torus, int across) {
    SmoothShape shape{torus, 0.5 * across, {}};
    SmoothRow row;
    row.shape = torus ? "torus" : "sphere";
    row.across = across;
    Random random(7);
    constexpr int positions = 3;
    for (int k = 0; k < positions; ++k) {
        shape.pose = random_pose(random);
        const Solid solid(grid_around(shape));
        const splitting::Surface surface(solid.grid);
        for (const splitting::SurfaceVertex& v : surface.vertices()) {
            if (!v.alive()) continue;
            const bool moved = v.kind == splitting::VertexKind::edge &&
                               is_moved(solid.grid.crossing(solid.grid.slot({v.lowest_node, v.axis})));
            if (moved)
                row.moved.add(shape.off(v.rest));
            else
                row.vertices.add(shape.off(v.rest) / shape.radius);
        }
        row.volume_error += std::abs(solid.extracted().mesh.volume() / shape.volume() - 1) / positions;
        row.normals.add(solid.opposing());
        row.unmoved_normals.add(
            count_opposing(solid.grid, surface,
                           [](const splitting::Crossing& c, const FaceCorners&) { return !is_moved(c); }));
    }
    return row;
}

}  // namespace

std::vector<SmoothRow> measure_smooth_shapes() {
    std::vector<SmoothRow> out;
    for (const bool torus : {false, true})
        for (const int across : {8, 16, 32, 64}) out.push_back(measure_smooth(torus, across));
    return out;
}

BoxRow measure_tilted_boxes(int boxes, const Parallel& parallel) {
    constexpr double side = 9;
    const Vec3 half = Vec3::Constant(side / 2);
    BoxRow row;
    row.boxes = boxes;
    Random random(11);
    for (int k = 0; k < boxes; ++k) {
        const Pose pose = random_pose(random);
        const TriangleMesh input = placed(geometry::make_box(2 * half), pose);
        const Solid solid(input, unit_grid(input), parallel);
        const SurfaceMesh out = solid.extracted();
        row.normals.add(solid.opposing());
        for (const Vec3& p : out.mesh.positions) {
            const double off = std::abs(off_box(pose.own(p), half));
            row.vertices.add(off);
            row.beyond_hundredth += off > 0.01;
            row.beyond_twentieth += off > 0.05;
        }
        for (const Vec3& corner : input.positions) {
            double nearest = 1e300;
            for (const Vec3& p : out.mesh.positions) nearest = std::min(nearest, (p - corner).norm());
            row.corners.add(nearest);
        }
    }
    return row;
}

constexpr double interior_below = -2;  // cells; excludes cells that also contain boundary surface

CutRow measure_cuts(const std::string& shape, double radius, int cuts, const Parallel& parallel) {
    const bool box = shape == "box";
    const Vec3 half = Vec3::Constant(0.7 * radius);
    const TriangleMesh mesh = box ? geometry::make_box(2 * half) : geometry::make_sphere(radius, 6);
    CutRow row;
    row.shape = shape;
    row.radius = radius;
    row.cuts = cuts;
    Random random(13);
    for (int k = 0; k < cuts; ++k) {
        const Pose pose = random_pose(random);
        const Vec3 normal = random_direction(random);
        const Vec3 middle = pose.offset + random.uniform(-0.7, 0.7) * radius * normal;
        const TriangleMesh input = placed(mesh, pose);
        Solid solid(input, unit_grid(input), parallel);
        const double before = solid.extracted().mesh.volume();
        splitting::cut_with_sheet(solid.grid, geometry::make_plane_sheet(middle, normal, 4 * radius), 0);
        const SurfaceMesh out = solid.extracted();
        row.normals.add(solid.opposing());
        row.largest_volume_change =
            std::max(row.largest_volume_change, std::abs(out.mesh.volume() / before - 1));
        const auto surface_distance = [&](const Vec3& p) {
            const Vec3 own = pose.own(p);
            return box ? off_box(own, half) : own.norm() - radius;
        };
        std::vector<bool> on_boundary(out.mesh.positions.size()), on_cut(on_boundary.size());
        const auto is_deep = [&](const Vec3& p) { return surface_distance(p) < interior_below; };
        for (std::size_t t = 0; t < out.mesh.triangles.size(); ++t)
            for (const std::uint32_t v : out.mesh.triangles[t])
                (out.triangle_origin[t] == geometry::Origin::cut ? on_cut : on_boundary)[v] = true;
        row.face_normals.add(count_opposing(solid.grid, splitting::Surface(solid.grid),
                                            [&](const splitting::Crossing& c, const FaceCorners& corners) {
                                                return c.origin == geometry::Origin::cut && !is_moved(c) &&
                                                       std::all_of(corners.begin(), corners.end(), is_deep);
                                            }));
        for (std::size_t v = 0; v < on_boundary.size(); ++v) {
            const Vec3& p = out.mesh.positions[v];
            const double off_plane = normal.dot(p - middle);
            if (on_boundary[v]) row.boundary.add(surface_distance(p));
            if (on_cut[v] && on_boundary[v]) row.rim.add(off_plane);
            if (on_cut[v] && is_deep(p)) row.face.add(off_plane);
        }
    }
    return row;
}

Opposing measure_folds(const TriangleMesh& mesh, int cells, const Parallel& parallel) {
    const RestGrid rest = geometry::grid_around(mesh.bounds(), geometry::cell_size_for(mesh.bounds(), cells));
    return Solid(mesh, rest, parallel).opposing();
}

}  // namespace splitcubes::app
