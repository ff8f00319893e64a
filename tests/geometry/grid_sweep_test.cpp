#include <splitcubes/geometry/grid_sweep.h>

#include "laws/solids.h"

#include <gtest/gtest.h>
#include <splitcubes/geometry/shapes.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

namespace splitcubes::geometry {
namespace {

using namespace laws;

RestGrid unit_grid(int nodes) {
    RestGrid grid;
    grid.cell_size = 1;
    grid.node_count = Vec3i::Constant(nodes);
    return grid;
}

// Winding number of every node, counted along the lines of one axis.
struct Windings {
    Vec3i count;
    std::vector<int> values;

    explicit Windings(const Vec3i& node_count)
        : count(node_count), values(static_cast<std::size_t>(node_count.prod()), 0) {}
    int& at(const Vec3i& node) {
        return values[static_cast<std::size_t>((node[2] * count[1] + node[1]) * count[0] + node[0])];
    }
};

Windings windings_along(const RestGrid& grid, const GridCrossings& sweep, int axis) {
    Windings out(grid.node_count);
    for (std::size_t i = sweep.axis_begin[axis]; i < sweep.axis_begin[axis + 1]; ++i) {
        const EdgeCrossing& c = sweep.crossings[i];
        Vec3i node = c.node;
        for (++node[axis]; node[axis] < grid.node_count[axis]; ++node[axis]) out.at(node) -= c.direction;
    }
    return out;
}

// Returns a problem, or an empty text if the three families agree and the directions on every line sum to
// zero.
std::string disagreement(const RestGrid& grid, const TriangleMesh& mesh) {
    const GridCrossings sweep = sweep_grid(grid, mesh);
    if (sweep.beyond_grid != 0) return "crossings beyond the grid";
    Windings x = windings_along(grid, sweep, 0);
    Windings y = windings_along(grid, sweep, 1);
    Windings z = windings_along(grid, sweep, 2);
    if (x.values != y.values) return "x and y lines differ";
    if (x.values != z.values) return "x and z lines differ";
    const Vec3i last = grid.node_count - Vec3i::Ones();
    for (int axis = 0; axis < 3; ++axis)
        for (int j = 0; j <= last[(axis + 2) % 3]; ++j)
            for (int i = 0; i <= last[(axis + 1) % 3]; ++i) {
                Vec3i node;
                node[axis] = last[axis];
                node[(axis + 1) % 3] = i;
                node[(axis + 2) % 3] = j;
                if (x.at(node) != 0) return "a line that does not come out again";
            }
    return "";
}

std::size_t wound_nodes(const RestGrid& grid, const TriangleMesh& mesh) {
    const Windings windings = windings_along(grid, sweep_grid(grid, mesh), 0);
    return static_cast<std::size_t>(
        std::count_if(windings.values.begin(), windings.values.end(), [](int w) { return w != 0; }));
}

Vec3 random_node(Random& random, int low, int high) {
    Vec3 out;
    for (int k = 0; k < 3; ++k)
        out[k] = low + static_cast<double>(random.below(static_cast<std::uint32_t>(high - low + 1)));
    return out;
}

TEST(GridSweep, FamiliesAgreeOnTiltedBoxes) {
    Random random(1);
    for (int trial = 0; trial < 200; ++trial) {
        const Vec3 size(random.uniform(0.1, 9), random.uniform(0.1, 9), random.uniform(0.1, 9));
        const TriangleMesh box = turned(make_box(size), random_rotation(random));
        const RestGrid grid = grid_around(box.bounds(), random.uniform(0.3, 1.5));
        ASSERT_EQ(disagreement(grid, box), "") << "trial " << trial;
    }
}

TEST(GridSweep, FamiliesAgreeOnSpheres) {
    Random random(2);
    for (int trial = 0; trial < 20; ++trial) {
        const TriangleMesh sphere = moved(make_sphere(random.uniform(1, 8), 3), random_vector(random, 3));
        const RestGrid grid = grid_around(sphere.bounds(), random.uniform(0.3, 1));
        ASSERT_EQ(disagreement(grid, sphere), "") << "trial " << trial;
        // Includes triangles smaller than the lattice's cells.
        const RestGrid coarse = grid_around(sphere.bounds(), 5);
        ASSERT_EQ(disagreement(coarse, sphere), "") << "trial " << trial;
    }
}

TEST(GridSweep, FamiliesAgreeOnVerticesEdgesAndFacesInNodes) {
    const RestGrid grid = unit_grid(12);
    for (int size = 1; size <= 9; ++size) {
        const TriangleMesh cube = box_between(Vec3::Ones(), Vec3::Constant(1 + size));
        ASSERT_EQ(disagreement(grid, cube), "");
        // Shifted by infinitesimals the cube contains as many nodes as cells.
        EXPECT_EQ(wound_nodes(grid, cube), static_cast<std::size_t>(size * size * size));
    }
    for (int radius = 1; radius <= 4; ++radius)
        ASSERT_EQ(disagreement(grid, octahedron(Vec3::Constant(5), radius)), "");
}

TEST(GridSweep, FamiliesAgreeOnTetrahedraWithCornersInNodes) {
    const RestGrid grid = unit_grid(10);
    Random random(3);
    for (int trial = 0; trial < 5000; ++trial) {
        TriangleMesh mesh;
        const int parts = 1 + static_cast<int>(random.below(3));
        for (int k = 0; k < parts; ++k) {
            const Vec3 a = random_node(random, 1, 8), b = random_node(random, 1, 8);
            const Vec3 c = random_node(random, 1, 8), d = random_node(random, 1, 8);
            mesh.append(tetrahedron(a, b, c, d));
        }
        ASSERT_EQ(disagreement(grid, mesh), "") << "trial " << trial;
    }
}

TEST(GridSweep, SolidsThatShareAFaceShareNoNode) {
    // A cube cut into six tetrahedra along its diagonal, all corners in nodes.
    const RestGrid grid = unit_grid(9);
    const double side = 6;
    const Vec3 low = Vec3::Ones();
    Windings sum(grid.node_count);
    for (const auto& order : {std::array{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}) {
        std::array<Vec3, 4> corner{low, low, low, low};
        for (std::size_t k = 1; k < 4; ++k) {
            corner[k] = corner[k - 1];
            corner[k][order[k - 1]] += side;
        }
        const TriangleMesh part = tetrahedron(corner[0], corner[1], corner[2], corner[3]);
        const Windings one = windings_along(grid, sweep_grid(grid, part), 1);
        for (std::size_t i = 0; i < sum.values.size(); ++i) sum.values[i] += one.values[i];
    }
    const Windings whole =
        windings_along(grid, sweep_grid(grid, box_between(low, low + Vec3::Constant(side))), 1);
    EXPECT_EQ(sum.values, whole.values);
}

TEST(GridSweep, NodesStrictlyInsideAndOutsideAreClassified) {
    const RestGrid grid = unit_grid(10);
    Random random(4);
    for (int trial = 0; trial < 300; ++trial) {
        const Vec3 center(random.uniform(3, 6), random.uniform(3, 6), random.uniform(3, 6));
        const double radius = random.uniform(0.2, 2.5);
        const TriangleMesh mesh = octahedron(center, radius);
        Windings windings = windings_along(grid, sweep_grid(grid, mesh), 2);
        for (int k = 0; k < 1000; ++k) {
            const Vec3i node(k % 10, k / 10 % 10, k / 100);
            const double distance = (node.cast<double>() - center).lpNorm<1>();
            // Vertices are snapped to a lattice of 2^-20 cells.
            if (std::abs(distance - radius) < 1e-5) continue;
            ASSERT_EQ(windings.at(node), distance < radius ? 1 : 0);
        }
    }
}

TEST(GridSweep, CrossingsLieOnTheirTriangle) {
    Random random(5);
    const TriangleMesh mesh = turned(make_torus(3, 1.2, 24, 12), random_rotation(random));
    const RestGrid grid = grid_around(mesh.bounds(), 0.37);
    const GridCrossings sweep = sweep_grid(grid, mesh);
    ASSERT_GT(sweep.crossings.size(), 1000U);
    for (const EdgeCrossing& c : sweep.crossings) {
        ASSERT_GE(c.parameter, 0);
        ASSERT_LE(c.parameter, 1);
        const Vec3 at = grid.node_position(c.node) + c.parameter * grid.cell_size * Vec3::Unit(c.axis);
        const Vec3 normal = triangle_normal(mesh, c.triangle);
        const Vec3& corner = mesh.positions[mesh.triangles[c.triangle][0]];
        // The error of snapped vertices along the line grows with the plane's slope.
        ASSERT_LT(std::abs(normal.dot(at - corner)), 2e-5 * grid.cell_size);
        ASSERT_EQ(c.direction, normal[c.axis] > 0 ? 1 : -1);
    }
}

TEST(GridSweep, CrossingsAreSortedByAxisLineAndNode) {
    const TriangleMesh mesh = make_sphere(4, 3);
    const GridCrossings sweep = sweep_grid(grid_around(mesh.bounds(), 0.6), mesh);
    const auto key = [](const EdgeCrossing& c) {
        return std::tuple(c.axis, c.node[(c.axis + 2) % 3], c.node[(c.axis + 1) % 3], c.node[c.axis],
                          c.parameter, c.triangle);
    };
    EXPECT_TRUE(
        std::is_sorted(sweep.crossings.begin(), sweep.crossings.end(),
                       [&](const EdgeCrossing& a, const EdgeCrossing& b) { return key(a) < key(b); }));
    EXPECT_EQ(sweep.axis_begin[0], 0U);
    EXPECT_EQ(sweep.axis_begin[3], sweep.crossings.size());
    for (int axis = 0; axis < 3; ++axis)
        for (std::size_t i = sweep.axis_begin[axis]; i < sweep.axis_begin[axis + 1]; ++i)
            ASSERT_EQ(sweep.crossings[i].axis, axis);
}

TEST(GridSweep, ASheetThroughNodesMeetsEveryLineOnce) {
    // Vertices and edges of the sheet coincide with nodes and lines; its diagonals pass over nodes.
    const RestGrid grid = unit_grid(11);
    for (const double height : {5.0, 5.25}) {
        const TriangleMesh sheet = make_plane_sheet({5, 5, height}, Vec3::UnitZ(), 8, 16);
        const GridCrossings sweep = sweep_grid(grid, sheet);
        EXPECT_EQ(sweep.axis_begin[2], 0U) << "lines that run within the sheet cross nothing";
        ASSERT_EQ(sweep.crossings.size(), 121U);
        for (const EdgeCrossing& c : sweep.crossings) {
            EXPECT_EQ(c.direction, 1);
            EXPECT_EQ(c.node[2] + c.parameter, height);
        }
    }
    // Every line along z meets tilted and wavy sheets exactly once.
    RestGrid tall = unit_grid(11);
    tall.origin[2] = -15;
    tall.node_count[2] = 41;
    Random random(6);
    for (int trial = 0; trial < 50; ++trial) {
        Vec3 normal = random_direction(random);
        normal[2] = std::copysign(1.5, normal[2]);
        const GridCrossings sweep = sweep_grid(tall, make_wavy_sheet({5, 5, 5}, normal, 30, 60, 0.2, 4));
        std::size_t along_z = 0;
        for (const EdgeCrossing& c : sweep.crossings) {
            if (c.axis != 2) continue;
            ++along_z;
            ASSERT_EQ(c.direction, normal[2] > 0 ? 1 : -1) << "trial " << trial;
        }
        EXPECT_EQ(along_z, 121U) << "trial " << trial;
        Windings steps = windings_along(tall, sweep, 2);
        for (int k = 0; k < 121; ++k)
            ASSERT_NE(steps.at({k % 11, k / 11, 40}), 0) << "a line that the sheet does not meet";
    }
}

TEST(GridSweep, TrianglesFarBeyondTheGridAreClipped) {
    const RestGrid grid = unit_grid(6);
    for (const double size : {1e6, 1e9, 1e12, 1e15}) {
        const TriangleMesh sheet = make_plane_sheet({2.5, 2.5, 2.25}, Vec3::UnitZ(), size);
        const GridCrossings sweep = sweep_grid(grid, sheet);
        ASSERT_EQ(sweep.crossings.size(), 36U) << size;
        for (const EdgeCrossing& c : sweep.crossings)
            EXPECT_NEAR(c.node[2] + c.parameter, 2.25, 1e-3) << size;
    }
}

TEST(TriangleNormal, IsUnitAtAnySize) {
    for (const double size : {1e-160, 1e-9, 1.0, 1e9, 1e150}) {
        TriangleMesh mesh;
        mesh.positions = {Vec3::Zero(), size * Vec3::UnitX(), size * Vec3::UnitY()};
        mesh.triangles = {{0, 1, 2}};
        EXPECT_EQ(triangle_normal(mesh, 0), Vec3::UnitZ()) << size;
    }
    TriangleMesh flat;
    flat.positions = {Vec3::Zero(), Vec3::UnitX(), 2 * Vec3::UnitX()};
    flat.triangles = {{0, 1, 2}, {0, 0, 0}};
    EXPECT_EQ(triangle_normal(flat, 0), Vec3::Zero());
    EXPECT_EQ(triangle_normal(flat, 1), Vec3::Zero());
}

}  // namespace
}  // namespace splitcubes::geometry
