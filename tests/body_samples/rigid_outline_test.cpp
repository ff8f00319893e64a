// The contact points of a rigid piece stand for the convex hull of its drawn vertices.
#include "laws/solids.h"
#include "splitting/cut_case.h"

#include <gtest/gtest.h>
#include <splitcubes/body_samples/rigid_outline.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/pieces.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::body {
namespace {

using laws::random_direction;
using splitting::NodeGrid;
using splitting::Pieces;
using splitting::Surface;
using Points = std::vector<Vec3>;

double support(const Points& points, const Vec3& direction) {
    double out = -std::numeric_limits<double>::infinity();
    for (const Vec3& p : points) out = std::max(out, direction.dot(p));
    return out;
}

std::vector<std::vector<Vec3i>> nodes_by_piece(const NodeGrid& grid, const Pieces& pieces) {
    std::vector<std::vector<Vec3i>> out(pieces.count());
    const Vec3i n = grid.rest().node_count;
    for (int z = 0; z < n[2]; ++z)
        for (int y = 0; y < n[1]; ++y)
            for (int x = 0; x < n[0]; ++x)
                if (grid.inside({x, y, z}))
                    out[static_cast<std::size_t>(pieces.piece_of(grid, {x, y, z}))].emplace_back(x, y, z);
    return out;
}

TEST(RigidOutline, ReachesAsFarAsTheDrawnVertices) {
    Random random(5);
    double worst = 0;
    for (int trial = 0; trial < 60; ++trial) {
        const NodeGrid grid = splitting::cases::grid_of(
            splitting::cases::random_case(random, 4, random.uniform(0.4, 1), random.uniform(0.1, 0.7)));
        const Surface surface(grid);
        const Pieces pieces(grid);
        const geometry::SurfaceMesh mesh = splitting::extract(grid, surface, pieces);
        const std::vector<std::vector<Vec3i>> nodes = nodes_by_piece(grid, pieces);
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            const Points drawn = splitting::extract_piece(mesh, static_cast<std::int32_t>(k)).mesh.positions;
            const Points outline = rigid_outline(grid, surface, nodes[k]);
            for (const Vec3& point : outline)
                ASSERT_NE(std::find(drawn.begin(), drawn.end(), point), drawn.end()) << "not a vertex";
            for (int d = 0; d < 50; ++d) {
                const Vec3 direction = random_direction(random);
                const double missing = support(drawn, direction) - support(outline, direction);
                worst = std::max(worst, missing / grid.rest().cell_size);
            }
        }
    }
    EXPECT_LT(worst, 0.1) << "cells";
    RecordProperty("largest_missing_cells", std::to_string(worst));
}

}  // namespace
}  // namespace splitcubes::body
