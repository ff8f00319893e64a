// Positions of the surface's vertices: accuracy for sharp and smooth shapes.
#include <splitcubes/splitting/placement.h>

#include "laws/solids.h"

#include <gtest/gtest.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/splitting/cube.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/solidify.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <vector>

namespace splitcubes::splitting {
namespace {

using namespace laws;
using geometry::TriangleMesh;

geometry::SurfaceMesh surface_of(const TriangleMesh& mesh, double cell_size) {
    static const Parallel parallel(2);
    SolidifyReport report;
    const NodeGrid grid = solidify(mesh, geometry::grid_around(mesh.bounds(), cell_size), report, parallel);
    return extract(grid, Surface(grid), Pieces(grid));
}

double distance_to_nearest(const Vec3& point, const std::vector<Vec3>& vertices) {
    double best = 1e300;
    for (const Vec3& v : vertices) best = std::min(best, (v - point).squaredNorm());
    return std::sqrt(best);
}

// Returns the largest distance from a corner of the cube to the surface's nearest vertex, cells.
double corner_error(const TriangleMesh& cube) {
    const geometry::SurfaceMesh surface = surface_of(cube, 1);
    double worst = 0;
    for (const Vec3& corner : cube.positions)
        worst = std::max(worst, distance_to_nearest(corner, surface.mesh.positions));
    return worst;
}

TEST(Corners, OfTiltedCubesAreMet) {
    Random random(7);
    for (int trial = 0; trial < 200; ++trial) {
        const double side = random.uniform(6, 12);
        const Quat rotation = random_rotation(random);
        const TriangleMesh cube = turned(geometry::make_box(Vec3::Constant(side)), rotation);
        ASSERT_LE(corner_error(cube), 0.06)
            << "trial " << trial << ", side " << side << ", rotation " << rotation.coeffs().transpose();
    }
}

TEST(Corners, OfAlignedCubesAreMet) {
    for (const double side : {5.0, 6.13, 7.5, 8.0, 9.99, 10.37})
        EXPECT_LE(corner_error(geometry::make_box(Vec3::Constant(side))), 0.06) << side;
}

struct SphereErrors {
    double largest = 0;      // cells
    double mean_square = 0;  // cells, its root
    double volume = 0;       // relative
    double facing_away = 0;  // share of triangles
};

SphereErrors sphere_errors(double radius, int subdivisions) {
    const TriangleMesh sphere = geometry::make_sphere(radius, subdivisions);
    const TriangleMesh mesh = surface_of(sphere, 1).mesh;
    SphereErrors out;
    for (const Vec3& p : mesh.positions) {
        const double distance = std::abs(p.norm() - radius);
        out.largest = std::max(out.largest, distance);
        out.mean_square += distance * distance / static_cast<double>(mesh.positions.size());
    }
    out.mean_square = std::sqrt(out.mean_square);
    out.volume = mesh.volume() / (4.0 / 3 * std::numbers::pi * std::pow(radius, 3)) - 1;
    std::size_t away = 0;
    for (const geometry::Triangle& t : mesh.triangles) {
        const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
        away += (b - a).cross(c - a).dot(a + b + c) < 0;
    }
    out.facing_away = static_cast<double>(away) / static_cast<double>(mesh.triangles.size());
    return out;
}

// The limits are slightly above the values measured when the test was written.
TEST(Spheres, SmallOneIsMet) {
    const SphereErrors errors = sphere_errors(9.3, 6);
    EXPECT_LE(errors.largest, 0.024);
    EXPECT_LE(errors.mean_square, 0.006);
    EXPECT_LE(std::abs(errors.volume), 2.9e-3);
    EXPECT_LE(errors.facing_away, 5e-4);
}

TEST(Spheres, LargerOneIsMetBetter) {
    const SphereErrors errors = sphere_errors(16.3, 7);
    EXPECT_LE(errors.largest, 0.0185);
    EXPECT_LE(errors.mean_square, 0.0036);
    EXPECT_LE(std::abs(errors.volume), 9.6e-4);
    EXPECT_EQ(errors.facing_away, 0);
}

TEST(PlaceFaceVertex, LiesOnAStraightSheet) {
    Random random(8);
    int crossed = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        const double angle = random.uniform(0, 2 * std::numbers::pi);
        const Vec2 normal(std::cos(angle), std::sin(angle));
        const Vec2 through(random.unit(), random.unit());
        unsigned mask = 0;
        std::array<FaceCrossing, 4> crossings;
        for (int k = 0; k < 4; ++k) {
            const Vec2 start[4] = {{0, 0}, {1, 0}, {0, 1}, {0, 0}};
            const Vec2 along = k % 2 == 0 ? Vec2(1, 0) : Vec2(0, 1);
            const double t = normal.dot(through - start[k]) / normal.dot(along);
            if (!(t > 0 && t < 1)) continue;
            mask |= 1U << k;
            const auto at = static_cast<std::size_t>(k);
            crossings[at] = face_crossing(k, t, normal[0], normal[1]);
            ASSERT_NEAR(normal.dot(crossings[at].point - through), 0, 1e-9);
        }
        if (std::popcount(mask) != 2) continue;
        ++crossed;
        const Vec2 vertex = place_face_vertex(mask, crossings).point;
        ASSERT_NEAR(normal.dot(vertex - through), 0, 1e-9);
        ASSERT_GE(vertex.minCoeff(), -1e-12);
        ASSERT_LE(vertex.maxCoeff(), 1 + 1e-12);
    }
    EXPECT_GT(crossed, 1900);
}

TEST(PlaceFaceVertex, LiesInTheCornerOfTwoLines) {
    // Ring edge 0 runs along u at v = 0, ring edge 1 along v at u = 1.
    std::array<FaceCrossing, 4> crossings;
    crossings[0] = face_crossing(0, 0.3, 1, 0);  // the line u = 0.3
    crossings[1] = face_crossing(1, 0.6, 0, 1);  // the line v = 0.6
    EXPECT_LT((place_face_vertex(3, crossings).point - Vec2(0.3, 0.6)).norm(), 1e-9);
}

TEST(PlaceFaceVertex, DoesNotLeaveTheWidenedFace) {
    Random random(9);
    for (int trial = 0; trial < 5000; ++trial) {
        std::array<FaceCrossing, 4> crossings;
        for (int k = 0; k < 4; ++k)
            crossings[static_cast<std::size_t>(k)] =
                face_crossing(k, random.unit(), random.uniform(-1, 1), random.uniform(-1, 1));
        for (unsigned mask = 0; mask < 16; ++mask) {
            const Vec2 vertex = place_face_vertex(mask, crossings).point;
            ASSERT_TRUE(vertex.allFinite());
            ASSERT_GE(vertex.minCoeff(), -0.25 - 1e-12);
            ASSERT_LE(vertex.maxCoeff(), 1.25 + 1e-12);
        }
    }
}

TEST(PlaceFaceVertex, IgnoresTheNormalsSigns) {
    Random random(10);
    for (int trial = 0; trial < 500; ++trial) {
        std::array<FaceCrossing, 4> crossings, turned_round;
        for (int k = 0; k < 4; ++k) {
            const auto at = static_cast<std::size_t>(k);
            crossings[at] = face_crossing(k, random.unit(), random.uniform(-1, 1), random.uniform(-1, 1));
            turned_round[at] = crossings[at];
            turned_round[at].normal = -crossings[at].normal;
        }
        for (const unsigned mask : {1U, 2U, 4U, 8U, 7U, 11U, 13U, 14U, 15U})
            ASSERT_LT((place_face_vertex(mask, crossings).point - place_face_vertex(mask, turned_round).point)
                          .norm(),
                      1e-9);
    }
}

// Returns the crossings of a cell's edges with the plane, and their mean.
std::vector<CellCrossing> plane_crossings(const Vec3& normal, const Vec3& through, Vec3& mean) {
    std::vector<CellCrossing> out;
    mean = Vec3::Zero();
    for (int e = 0; e < edge_count; ++e) {
        const int lower = edge_corner(e, 0);
        const Vec3 start(corner_bit(lower, 0), corner_bit(lower, 1), corner_bit(lower, 2));
        const double t = normal.dot(through - start) / normal[edge_axis(e)];
        if (!(t > 0 && t < 1)) continue;
        out.push_back({start + t * Vec3::Unit(edge_axis(e)), normal, false});
        mean += out.back().point;
    }
    mean /= static_cast<double>(std::max<std::size_t>(out.size(), 1));
    return out;
}

TEST(PlaceCentre, LiesOnAPlane) {
    Random random(11);
    for (int trial = 0; trial < 1000; ++trial) {
        const Vec3 normal = random_direction(random);
        const Vec3 through(random.unit(), random.unit(), random.unit());
        Vec3 mean;
        const std::vector<CellCrossing> crossings = plane_crossings(normal, through, mean);
        for (const bool oriented : {true, false}) {
            const Vec3 centre = place_centre(crossings, oriented, mean);
            ASSERT_NEAR(normal.dot(centre - through), 0, 1e-9);
            ASSERT_GE(centre.minCoeff(), -1e-9);
            ASSERT_LE(centre.maxCoeff(), 1 + 1e-9);
        }
    }
}

TEST(PlaceCentre, LiesWhereThreePlanesMeet) {
    Random random(12);
    for (int trial = 0; trial < 300; ++trial) {
        const Quat rotation = random_rotation(random);
        const Vec3 corner(random.uniform(-0.4, 1.4), random.uniform(-0.4, 1.4), random.uniform(-0.4, 1.4));
        std::vector<CellCrossing> crossings;
        Vec3 mean = Vec3::Zero();
        for (int k = 0; k < 3; ++k) {
            const Vec3 normal = rotation * Vec3::Unit(k);
            // Any point of the plane in the cell will do; this one is nearest to the cell's middle.
            const Vec3 middle = Vec3::Constant(0.5);
            crossings.push_back({middle + normal * normal.dot(corner - middle), normal, false});
            mean += crossings.back().point / 3;
        }
        if ((mean.array() < 0).any() || (mean.array() > 1).any()) continue;
        ASSERT_LT((place_centre(crossings, true, mean) - corner).norm(), 1e-9);
    }
}

TEST(PlaceCentre, DoesNotLeaveTheWidenedCell) {
    Random random(13);
    for (int trial = 0; trial < 20000; ++trial) {
        std::vector<CellCrossing> crossings;
        Vec3 mean = Vec3::Zero();
        const std::uint32_t count = 1 + random.below(12);
        for (std::uint32_t k = 0; k < count; ++k) {
            Vec3 point(random.unit(), random.unit(), random.unit());
            crossings.push_back({point, random_direction(random), random.below(4) == 0});
            mean += point / count;
        }
        const Vec3 centre = place_centre(crossings, random.below(2) == 0, mean);
        ASSERT_TRUE(centre.allFinite());
        ASSERT_GE(centre.minCoeff(), -1 - 1e-9);
        ASSERT_LE(centre.maxCoeff(), 2 + 1e-9);
    }
}

}  // namespace
}  // namespace splitcubes::splitting
