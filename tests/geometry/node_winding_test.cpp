// Winding numbers at nodes are those of the solid angles, wherever the mesh lies.
#include <splitcubes/geometry/node_winding.h>

#include "laws/solids.h"

#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/geometry/winding_number.h>

#include <cmath>
#include <limits>

namespace splitcubes::geometry {
namespace {

using namespace laws;

const RestGrid grid{Vec3(-0.53, -0.61, -0.47), 0.1, Vec3i(11, 12, 10)};

// Compares all nodes; those that the mesh passes within a lattice step are left out.
void expect_solid_angles(const TriangleMesh& mesh, const char* what) {
    SCOPED_TRACE(what);
    const Vec3i n = grid.node_count;
    std::vector<int> found(static_cast<std::size_t>(n.prod()), 0);
    const auto index = [&](int x, int y, int z) {
        return static_cast<std::size_t>(x + n[0] * (y + n[1] * z));
    };
    for (const WindingRun& run : node_windings(grid, mesh)) {
        ASSERT_NE(run.winding, 0);
        ASSERT_TRUE(0 <= run.first && run.first < run.last && run.last <= n[0]);
        for (int x = run.first; x < run.last; ++x) found[index(x, run.y, run.z)] += run.winding;
    }
    const WindingNumber winding(mesh);
    std::size_t compared = 0;
    for (int z = 0; z < n[2]; ++z)
        for (int y = 0; y < n[1]; ++y)
            for (int x = 0; x < n[0]; ++x) {
                const double angle = winding.exact_at(grid.node_position({x, y, z}));
                if (std::abs(angle - std::round(angle)) > 1e-6) continue;
                ++compared;
                ASSERT_EQ(found[index(x, y, z)], static_cast<int>(std::round(angle)))
                    << x << ' ' << y << ' ' << z;
            }
    EXPECT_GT(compared, found.size() / 2);
}

TEST(NodeWinding, IsTheSolidAngleOverFourPi) {
    Random random(11);
    for (int trial = 0; trial < 8; ++trial) {
        SCOPED_TRACE(trial);
        const Vec3 at = random_vector(random, 0.6);
        const double size = std::pow(10, random.uniform(-1.5, 1));
        const Quat turn = random_rotation(random);
        const TriangleMesh ball = moved(scaled(make_sphere(1, 2), size), at);
        const TriangleMesh ring = moved(turned(make_torus(size, 0.4 * size, 24, 12), turn), at);
        expect_solid_angles(ball, "ball");
        expect_solid_angles(reversed(ball), "inside out");
        expect_solid_angles(ring, "ring");
        expect_solid_angles(joined(ball, ring), "overlapping");
        expect_solid_angles(joined(ball, reversed(moved(ball, Vec3::Constant(0.3 * size)))), "opposite");
    }
}

TEST(NodeWinding, IsOneAllOverInAMeshThatEnclosesTheGrid) {
    for (const double size : {3.0, 1e3, 1e5, 1e7, 1e9}) {
        const TriangleMesh ball = make_sphere(size, 2);
        const std::vector<WindingRun> runs = node_windings(grid, ball);
        ASSERT_EQ(runs.size(), static_cast<std::size_t>(grid.node_count[1] * grid.node_count[2])) << size;
        for (const WindingRun& run : runs) {
            ASSERT_EQ(run.winding, 1);
            ASSERT_EQ(run.last - run.first, grid.node_count[0]);
        }
        EXPECT_TRUE(node_windings(grid, moved(ball, Vec3(-1.5, 0.2, 0.1) * size)).empty()) << size;
        EXPECT_TRUE(node_windings(grid, moved(ball, Vec3(1.5, 0.2, 0.1) * size)).empty()) << size;
    }
}

// One face of a box is a plane through the grid; the others are out of reach of the sweep.
TEST(NodeWinding, AFaceOfAHugeMeshSplitsTheGrid) {
    for (const double size : {10.0, 1e6, 1e8})
        for (int axis = 0; axis < 3; ++axis)
            for (const double side : {-1.0, 1.0}) {
                const Vec3 shift = side * (size / 2 + 0.013) * Vec3::Unit(axis);
                expect_solid_angles(moved(make_box(Vec3::Constant(size)), shift), "box");
                // Through the nodes of a face of the grid: all of the rest agrees.
                const double face = side > 0
                                        ? grid.origin[axis]
                                        : grid.origin[axis] + grid.cell_size * (grid.node_count[axis] - 1);
                TriangleMesh box = box_between(Vec3::Constant(-size), Vec3::Constant(size));
                for (Vec3& p : box.positions)
                    if (p[axis] * side < 0) p[axis] = face;
                expect_solid_angles(box, "box on the grid's face");
            }
}

TEST(NodeWinding, NothingAndNonsense) {
    EXPECT_TRUE(node_windings(grid, {}).empty());
    TriangleMesh mesh = make_sphere(1, 1);
    mesh.positions[3][1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(node_windings(grid, mesh), InputError);
    mesh = make_sphere(1, 1);
    mesh.triangles[5][0] = 4000;
    EXPECT_THROW(node_windings(grid, mesh), InputError);
}

}  // namespace
}  // namespace splitcubes::geometry
