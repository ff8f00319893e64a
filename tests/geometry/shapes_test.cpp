#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/geometry/winding_number.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

using namespace splitcubes;
using namespace splitcubes::geometry;

namespace {

constexpr double pi = std::numbers::pi;

struct Solid {
    const char* name;
    std::function<TriangleMesh(int)> make;  // by refinement level, each twice as fine
    double volume, area;                    // of the exact shape
};

// Volume and area of the pear of height 2, by the trapezoidal rule over the polar angle,
// which converges fast for this smooth periodic integrand.
double pear_volume() {
    constexpr int n = 2000;
    double sum = 0;
    for (int k = 0; k < n; ++k) {
        const double angle = pi * (k + 0.5) / n, r = pear_outline(-std::cos(angle));
        sum += pi * r * r * std::sin(angle) * pi / n;
    }
    return sum;
}

double pear_area() {
    constexpr int n = 20000;
    double sum = 0;
    Vec2 before(0, -1);
    for (int k = 1; k <= n; ++k) {
        const double z = -std::cos(pi * k / n);
        const Vec2 now(k == n ? 0 : pear_outline(z), z);
        sum += pi * (now[0] + before[0]) * (now - before).norm();
        before = now;
    }
    return sum;
}

std::vector<Solid> solids() {
    return {
        {"sphere", [](int level) { return make_sphere(0.7, level + 1); }, 4 * pi / 3 * 0.343, 4 * pi * 0.49},
        {"cylinder", [](int level) { return make_cylinder(0.5, 2, 12 << level); }, pi * 0.25 * 2,
         2 * pi * 0.25 + 2 * pi * 0.5 * 2},
        {"torus", [](int level) { return make_torus(1, 0.3, 12 << level, 8 << level); }, 2 * pi * pi * 0.09,
         4 * pi * pi * 0.3},
        {"capsule", [](int level) { return make_capsule(0.4, 1.1, 12 << level); },
         4 * pi / 3 * 0.064 + pi * 0.16 * 1.1, 4 * pi * 0.16 + 2 * pi * 0.4 * 1.1},
        {"ball capsule", [](int level) { return make_capsule(0.4, 0, 12 << level); }, 4 * pi / 3 * 0.064,
         4 * pi * 0.16},
        {"pear", [](int level) { return make_pear(2, 16 << level); }, pear_volume(), pear_area()},
    };
}

}  // namespace

TEST(Shapes, SolidsAreClosedOrientedManifolds) {
    for (const Solid& solid : solids())
        for (int level = 0; level < 4; ++level) {
            const TriangleMesh mesh = solid.make(level);
            const MeshCheck check = check_mesh(mesh);
            EXPECT_TRUE(check.valid()) << solid.name;
            EXPECT_EQ(check.parts.size(), 1U) << solid.name;
            EXPECT_EQ(check.vertices, mesh.positions.size()) << solid.name;
            EXPECT_GT(mesh.volume(), 0) << solid.name;
            for (const Triangle& t : mesh.triangles)
                EXPECT_GT((mesh.positions[t[1]] - mesh.positions[t[0]])
                              .cross(mesh.positions[t[2]] - mesh.positions[t[0]])
                              .norm(),
                          0)
                    << solid.name;
        }
    EXPECT_TRUE(check_mesh(make_box({1, 2, 3})).valid());
}

TEST(Shapes, VolumeAndAreaConvergeQuadratically) {
    for (const Solid& solid : solids()) {
        const auto error = [](double value, double truth) { return std::abs(value / truth - 1); };
        const TriangleMesh coarse = solid.make(2), fine = solid.make(3);
        EXPECT_LT(error(fine.volume(), solid.volume), 0.01) << solid.name;
        EXPECT_LT(error(fine.area(), solid.area), 0.01) << solid.name;
        EXPECT_NEAR(error(coarse.volume(), solid.volume) / error(fine.volume(), solid.volume), 4, 0.5)
            << solid.name;
        EXPECT_NEAR(error(coarse.area(), solid.area) / error(fine.area(), solid.area), 4, 0.8) << solid.name;
        EXPECT_LT(fine.volume(), solid.volume) << solid.name;
    }
}

TEST(Shapes, BoxIsExact) {
    const TriangleMesh box = make_box({1, 2, 3});
    EXPECT_DOUBLE_EQ(box.volume(), 6);
    EXPECT_DOUBLE_EQ(box.area(), 22);
    EXPECT_EQ(box.bounds().min, Vec3(-0.5, -1, -1.5));
    EXPECT_EQ(box.bounds().max, Vec3(0.5, 1, 1.5));
}

TEST(Shapes, AreCentredWithZUp) {
    const auto half = [](const TriangleMesh& mesh) {
        EXPECT_LT(mesh.bounds().center().norm(), 1e-12);
        return Vec3(0.5 * mesh.bounds().size());
    };
    EXPECT_LT((half(make_cylinder(0.5, 3, 64)) - Vec3(0.5, 0.5, 1.5)).norm(), 1e-12);
    EXPECT_LT((half(make_torus(1, 0.25, 64, 32)) - Vec3(1.25, 1.25, 0.25)).norm(), 1e-12);
    EXPECT_LT((half(make_capsule(0.5, 2, 64)) - Vec3(0.5, 0.5, 1.5)).norm(), 1e-12);
    EXPECT_NEAR(half(make_pear(3, 64)).z(), 1.5, 1e-12);
    const TriangleMesh sphere = make_sphere(2, 3);
    for (const Vec3& p : sphere.positions) EXPECT_NEAR(p.norm(), 2, 1e-12);
}

TEST(Shapes, OutsideIsOutside) {
    for (const Solid& solid : solids()) {
        const TriangleMesh mesh = solid.make(1);
        const WindingNumber winding(mesh);
        for (std::size_t k = 0; k < mesh.triangles.size(); k += 23) {
            const Triangle& t = mesh.triangles[k];
            const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
            const Vec3 normal = (b - a).cross(c - a).normalized(), middle = (a + b + c) / 3;
            EXPECT_NEAR(winding.exact_at(middle + 1e-5 * normal), 0, 1e-9) << solid.name;
            EXPECT_NEAR(winding.exact_at(middle - 1e-5 * normal), 1, 1e-9) << solid.name;
        }
    }
}

TEST(Shapes, ThePearHasABellyBelowAndAConcaveNeckAbove) {
    double widest = 0, widest_z = 0;
    int bends = 0;
    double before = 0;
    constexpr double step = 1e-3;
    for (double z = -1 + 2 * step; z < 1 - 2 * step; z += step) {
        const double r = pear_outline(z);
        EXPECT_GT(r, 0);
        if (r > widest) {
            widest = r;
            widest_z = z;
        }
        const double bend = pear_outline(z + step) - 2 * r + pear_outline(z - step);
        if (before != 0 && (bend > 0) != (before > 0)) ++bends;
        before = bend;
        // Smooth, without kinks.
        if (std::abs(z) < 0.95) {
            EXPECT_LT(std::abs(bend), 30 * step * step);
        }
    }
    EXPECT_NEAR(widest, 0.65, 0.002);
    EXPECT_NEAR(widest_z, -0.35, 0.01);
    EXPECT_EQ(bends, 2);  // concave between two inflections
    EXPECT_LT(pear_outline(0.6), 0.5 * widest);
    EXPECT_EQ(pear_outline(-1), 0);
    EXPECT_EQ(pear_outline(1), 0);
    EXPECT_EQ(pear_outline(1.5), 0);
}

TEST(Shapes, SheetsLieWhereTheyShould) {
    const Vec3 center(1, 2, 3), normal(1, -1, 0.5);
    const TriangleMesh plane = make_plane_sheet(center, normal, 2, 5);
    EXPECT_EQ(plane.triangles.size(), 50U);
    EXPECT_NEAR(plane.area(), 16, 1e-12);
    for (const Vec3& p : plane.positions) EXPECT_NEAR((p - center).dot(normal), 0, 1e-12);
    for (const Triangle& t : plane.triangles)
        EXPECT_GT((plane.positions[t[1]] - plane.positions[t[0]])
                      .cross(plane.positions[t[2]] - plane.positions[t[0]])
                      .dot(normal),
                  0);
    const MeshCheck check = check_mesh(plane);
    EXPECT_EQ(check.boundary_edges, 20U);
    EXPECT_TRUE(check.oriented());

    const TriangleMesh wavy = make_wavy_sheet(center, normal, 2, 64, 0.25, 1);
    double highest = 0;
    for (const Vec3& p : wavy.positions)
        highest = std::max(highest, std::abs((p - center).dot(normal.normalized())));
    EXPECT_NEAR(highest, 0.25, 1e-3);
    EXPECT_TRUE(check_mesh(wavy).oriented());
    // The wave repeats along s after one wavelength.
    EXPECT_NEAR((wavy.positions[5] - wavy.positions[5 + 16]).norm(), 1, 1e-9);
}

TEST(Shapes, RefuseInvalidSizes) {
    const double inf = std::numeric_limits<double>::infinity(), nan = std::nan("");
    for (const double bad : {0.0, -1.0, inf, nan}) {
        EXPECT_THROW(make_box({1, bad, 1}), InputError);
        EXPECT_THROW(make_sphere(bad), InputError);
        EXPECT_THROW(make_cylinder(1, bad), InputError);
        EXPECT_THROW(make_torus(1, bad), InputError);
        EXPECT_THROW(make_capsule(bad, 1), InputError);
        EXPECT_THROW(make_pear(bad), InputError);
        EXPECT_THROW(make_plane_sheet({0, 0, 0}, {0, 0, 1}, bad), InputError);
    }
    EXPECT_THROW(make_capsule(1, -1), InputError);
    EXPECT_THROW(make_torus(1, 1), InputError);
    EXPECT_THROW(make_sphere(1, 20), InputError);
    EXPECT_THROW(make_cylinder(1, 1, 2), InputError);
    EXPECT_THROW(make_plane_sheet({0, 0, 0}, {0, 0, 0}, 1), InputError);
    EXPECT_THROW(make_plane_sheet({0, 0, 0}, {0, 0, 1}, 1, 0), InputError);
}
