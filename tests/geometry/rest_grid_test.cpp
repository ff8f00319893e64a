#include <splitcubes/geometry/rest_grid.h>

#include "laws/solids.h"

#include <gtest/gtest.h>
#include <splitcubes/core/error.h>

#include <cmath>
#include <limits>

namespace splitcubes::geometry {
namespace {

using namespace laws;

Vec3 last_node(const RestGrid& grid) {
    return grid.node_position(grid.node_count - Vec3i::Ones());
}

// Returns the distance in cells from a plane at `coordinate` on an axis to the nearest node.
double to_nearest_node(const RestGrid& grid, int axis, double coordinate) {
    const double cells = (coordinate - grid.origin[axis]) / grid.cell_size;
    return std::abs(cells - std::round(cells));
}

TEST(GridAround, CoversTheBoxAndALayerAroundIt) {
    Random random(1);
    for (int trial = 0; trial < 2000; ++trial) {
        const double scale = std::pow(10, random.uniform(-5, 5));
        Box box;
        box.add(scale * random_vector(random, 3));
        box.add(scale * random_vector(random, 3));
        const double cell = box.size().maxCoeff() / random.uniform(2, 80);
        const RestGrid grid = grid_around(box, cell);
        EXPECT_EQ(grid.cell_size, cell);
        for (int axis = 0; axis < 3; ++axis) {
            ASSERT_LT(grid.origin[axis], box.min[axis]);
            ASSERT_GT(last_node(grid)[axis], box.max[axis]);
            // Symmetric about the box, and no larger than necessary.
            const double below = box.min[axis] - grid.origin[axis];
            const double above = last_node(grid)[axis] - box.max[axis];
            ASSERT_NEAR(below, above, 1e-9 * box.size().maxCoeff());
            ASSERT_LT(below, 2.01 * cell);
            // One of the two parities always keeps a distance of a quarter cell.
            ASSERT_GT(to_nearest_node(grid, axis, box.min[axis]), 0.249);
            ASSERT_GT(to_nearest_node(grid, axis, box.max[axis]), 0.249);
        }
    }
}

TEST(GridAround, KeepsHalfACellFromTheFacesOfWholeCells) {
    for (int cells = 1; cells <= 40; ++cells) {
        const Box box{Vec3::Zero(), Vec3::Constant(cells)};
        const RestGrid grid = grid_around(box, 1);
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(to_nearest_node(grid, axis, cells), 0.5, 1e-12) << cells;
    }
}

TEST(GridAround, CoversAFlatBox) {
    const RestGrid grid = grid_around({Vec3(0, 0, 1), Vec3(4, 4, 1)}, 0.5);
    EXPECT_LT(grid.origin[2], 1);
    EXPECT_GT(last_node(grid)[2], 1);
}

TEST(GridAround, RefusesImpossibleGrids) {
    const Box box{Vec3::Zero(), Vec3::Ones()};
    EXPECT_THROW(grid_around({}, 1), InputError);
    for (const double cell : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity(), 1.0 / 1025})
        EXPECT_THROW(grid_around(box, cell), InputError) << cell;
    EXPECT_NO_THROW(grid_around(box, 1.0 / max_cells_per_axis));
    Box endless = box;
    endless.max[1] = std::numeric_limits<double>::infinity();
    EXPECT_THROW(grid_around(endless, 0.1), InputError);
}

TEST(CellSizeFor, DividesTheLongestSide) {
    const Box box{Vec3::Zero(), Vec3(1, 3, 2)};
    EXPECT_DOUBLE_EQ(cell_size_for(box, 48), 3.0 / 48);
    EXPECT_THROW(cell_size_for(box, 1), InputError);
    EXPECT_THROW(cell_size_for(box, max_cells_per_axis + 1), InputError);
    EXPECT_THROW(cell_size_for({Vec3::Ones(), Vec3::Ones()}, 8), InputError);
}

TEST(RestGrid, PositionsAndGridCoordinatesAreInverse) {
    const RestGrid grid{Vec3(-1, 2, 7), 0.25, Vec3i(5, 6, 7)};
    EXPECT_EQ(grid.to_grid(grid.node_position({3, 0, 6})), Vec3(3, 0, 6));
    EXPECT_TRUE(grid.contains({4, 5, 6}));
    EXPECT_FALSE(grid.contains({5, 5, 6}));
    EXPECT_FALSE(grid.contains({0, -1, 0}));
}

}  // namespace
}  // namespace splitcubes::geometry
