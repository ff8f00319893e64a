// Results for a soup of triangles equal the sum over all triangles.
#include <splitcubes/splitting/soup_edges.h>

#include "laws/solids.h"

#include <gtest/gtest.h>

#include <cmath>

namespace splitcubes::splitting {
namespace {

using namespace laws;
using geometry::TriangleMesh;

// Boxes around the triangles are `size` of the cube at most; from 1 on corners lie anywhere in it.
TriangleMesh crowd_mesh(std::uint64_t seed, std::uint32_t count, double size) {
    Random random(seed);
    TriangleMesh mesh;
    for (std::uint32_t t = 0; t < count; ++t) {
        const Vec3 center = size < 1 ? random_vector(random, 0.5) : Vec3(Vec3::Zero());
        for (int k = 0; k < 3; ++k) mesh.positions.push_back(center + random_vector(random, 0.5 * size));
        mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    return mesh;
}

struct CrowdCase {
    TriangleMesh mesh;
    RestGrid rest;
    Parallel parallel;
    geometry::GridCrossings sweep;
    geometry::WindingNumber winding;

    CrowdCase(TriangleMesh triangles, int cells, int threads)
        : mesh(std::move(triangles)),
          rest(geometry::grid_around(mesh.bounds(), geometry::cell_size_for(mesh.bounds(), cells))),
          parallel(threads),
          sweep(geometry::sweep_grid(rest, mesh, parallel)),
          winding(mesh) {}
    SoupEdges edges() const { return {mesh, rest, sweep, winding, parallel}; }
    double exact(const Vec3i& node, int axis, double parameter) const {
        return std::abs(
            winding.exact_at(rest.node_position(node) + parameter * rest.cell_size * Vec3::Unit(axis)));
    }
};

TEST(SoupEdges, SayWhatTheSumOverAllSays) {
    for (const double size : {0.05, 0.2, 0.5, 1.0}) {
        SCOPED_TRACE(size);
        const CrowdCase c(crowd_mesh(1, 2000, size), 10, 2);
        const SoupEdges edges = c.edges();
        const Vec3i n = c.rest.node_count;
        std::size_t index = 0, compared = 0, unknown = 0, stretches = 0;
        for (int z = 0; z < n[2]; ++z)
            for (int y = 0; y < n[1]; ++y)
                for (int x = 0; x < n[0]; ++x, ++index) {
                    const Vec3i node(x, y, z);
                    if ((node.array() == 0).any() || (node.array() == n.array() - 1).any()) {
                        EXPECT_EQ(edges.inside()[index], 0);
                        continue;
                    }
                    const double w = c.exact(node, 0, 0);
                    if (std::abs(w - 0.5) > 2e-3) {
                        ASSERT_EQ(edges.inside()[index] != 0, w > 0.5) << node.transpose();
                    }
                }
        const auto& all = c.sweep.crossings;
        const std::size_t stride = 1 + all.size() / 4000;
        for (std::size_t k = 0; k + 1 < all.size(); ++k) {
            if (all[k].axis != all[k + 1].axis || all[k].node != all[k + 1].node) continue;
            ++stretches;
            unknown += edges.after()[k] == SoupEdges::unknown;
            if (edges.after()[k] == SoupEdges::unknown || k % stride != 0) continue;
            const double t = 0.5 * (all[k].parameter + all[k + 1].parameter);
            ASSERT_EQ(edges.after()[k] != 0, c.exact(all[k].node, all[k].axis, t) > 0.5) << k;
            ++compared;
        }
        EXPECT_LT(static_cast<double>(unknown), 0.1 * static_cast<double>(stretches) + 5);
        EXPECT_TRUE(size < 0.5 || compared > 1000) << compared;
        EXPECT_TRUE(size < 0.2 || !edges.holes().empty());
        for (const BoundaryCut& cut : edges.holes()) {
            const double w = c.exact(cut.edge.node, cut.edge.axis, cut.parameter);
            // An edge that ends in the grid's outermost nodes need not have such a point.
            if (cut.parameter > 1e-5 && cut.parameter < 1 - 1e-5) {
                ASSERT_NEAR(w, 0.5, 5e-3);
            }
        }
    }
}

TEST(SoupEdges, ThreadsDoNotMatter) {
    const CrowdCase one(crowd_mesh(2, 1500, 1), 9, 1), three(crowd_mesh(2, 1500, 1), 9, 3);
    const SoupEdges a = one.edges(), b = three.edges();
    EXPECT_EQ(a.inside(), b.inside());
    EXPECT_EQ(a.after(), b.after());
    ASSERT_EQ(a.holes().size(), b.holes().size());
    for (std::size_t k = 0; k < a.holes().size(); ++k) {
        EXPECT_EQ(a.holes()[k].parameter, b.holes()[k].parameter);
        EXPECT_EQ(a.holes()[k].normal, b.holes()[k].normal);
    }
}

// Triangles in the planes of the grid, corners in its nodes: nothing there is decided by rounding.
TEST(SoupEdges, TrianglesInNodesAreLeftToTheSum) {
    Random random(3);
    TriangleMesh mesh;
    for (std::uint32_t t = 0; t < 600; ++t) {
        for (int k = 0; k < 3; ++k)
            mesh.positions.emplace_back(random.below(9) / 8.0, random.below(9) / 8.0, random.below(9) / 8.0);
        mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    const CrowdCase c(mesh, 8, 2);
    const SoupEdges edges = c.edges();
    const auto& all = c.sweep.crossings;
    for (std::size_t k = 0; k + 1 < all.size(); k += 3) {
        if (edges.after()[k] == SoupEdges::unknown) continue;
        const double t = 0.5 * (all[k].parameter + all[k + 1].parameter);
        ASSERT_EQ(edges.after()[k] != 0, c.exact(all[k].node, all[k].axis, t) > 0.5) << k;
    }
}

TEST(SoupEdges, AreForCrowdsOnly) {
    const auto pays = [](const TriangleMesh& mesh) {
        const CrowdCase c(mesh, 8, 1);
        return SoupEdges::pays(c.winding, c.mesh, c.rest);
    };
    EXPECT_TRUE(pays(crowd_mesh(4, 3000, 1)));
    EXPECT_FALSE(pays(crowd_mesh(4, 300, 1)));
    EXPECT_FALSE(pays(crowd_mesh(4, 3000, 0.02)));
}

}  // namespace
}  // namespace splitcubes::splitting
