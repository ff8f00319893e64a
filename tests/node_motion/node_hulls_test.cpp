// The maps of phyxels in reach of a node lie in the node's hull.
#include <splitcubes/core/random.h>
#include <splitcubes/node_motion/node_hulls.h>

#include <gtest/gtest.h>

#include <vector>

namespace splitcubes::body {
namespace {

constexpr double hull_cell = 0.02;

struct HullInfluence {
    Vec3 from_centre;
    double reach;
    NodeHulls::State now, before;
};

Vec3 random_in_hull(Random& random, double half) {
    const double x = random.uniform(-half, half), y = random.uniform(-half, half);
    return {x, y, random.uniform(-half, half)};
}

NodeHulls::State random_hull_state(Random& random, double size) {
    NodeHulls::State state{random_in_hull(random, size), Mat3::Zero()};
    for (int k = 0; k < 3; ++k) state.matrix.col(k) = random_in_hull(random, 0.5);
    return state;
}

std::vector<HullInfluence> random_hull_influences(Random& random, int count, double size) {
    std::vector<HullInfluence> out;
    for (int k = 0; k < count; ++k)
        out.push_back({random_in_hull(random, 5 * hull_cell), random.uniform(2 * hull_cell, 4 * hull_cell),
                       random_hull_state(random, size), random_hull_state(random, size)});
    return out;
}

Vec3 from_centre(const Vec3i& node) {
    return hull_cell * (node.cast<double>() - Vec3::Constant(0.5 * NodeHulls::side));
}

Vec3i first_of(int block) {
    return NodeHulls::block_side * Vec3i(block & 1, block >> 1 & 1, block >> 2);
}

class NodeHullsOfSize : public testing::TestWithParam<double> {};

TEST_P(NodeHullsOfSize, ContainTheMapsOfPhyxelsInReachTightly) {
    Random random(5);
    NodeHulls hulls;
    const double size = GetParam(), largest = size + 1.5 * hull_cell;
    int reached = 0;
    for (int round = 0; round < 20; ++round) {
        const std::vector<HullInfluence> influences = random_hull_influences(random, 30, size);
        hulls.start(hull_cell);
        for (const HullInfluence& c : influences) hulls.add(c.from_centre, c.reach, c.now, c.before);
        ASSERT_TRUE(hulls.finish());
        for (int block = 0; block < NodeHulls::block_count; ++block) {
            hulls.choose_block(block);
            const geometry::Box whole = hulls.box_of_block().grown(1e-5 * largest);
            for (int k = 0; k < 27; ++k) {
                const Vec3i node = first_of(block) + Vec3i(k % 3, k / 3 % 3, k / 9);
                const Vec3 at = from_centre(node);
                geometry::Box exact;
                for (const HullInfluence& c : influences) {
                    if ((c.from_centre - at).norm() > c.reach) continue;
                    exact.add(c.now.off + (c.now.matrix - hulls.mean()) * at);
                    exact.add(c.before.off + (c.before.matrix - hulls.mean()) * at);
                }
                const geometry::Box& hull = hulls.box_of(node);
                if (exact.empty()) continue;
                ++reached;
                ASSERT_TRUE(hull.contains(exact.min) && hull.contains(exact.max));
                ASSERT_TRUE(hulls.box_of_cube().contains(exact.min));
                ASSERT_TRUE(hulls.box_of_cube().contains(exact.max));
                ASSERT_TRUE(whole.contains(hull.min) && whole.contains(hull.max));
                ASSERT_TRUE(exact.grown(1e-5 * largest).contains(hull.min));
                ASSERT_TRUE(exact.grown(1e-5 * largest).contains(hull.max));
            }
        }
    }
    EXPECT_GT(reached, 1000);
}

INSTANTIATE_TEST_SUITE_P(Sizes, NodeHullsOfSize, testing::Values(0.001, 0.1, 1e4));

TEST(NodeHulls, AreEmptyWhereNoPhyxelReaches) {
    NodeHulls hulls;
    hulls.start(hull_cell);
    EXPECT_TRUE(hulls.empty());
    hulls.add(Vec3::Constant(-2 * hull_cell), hull_cell, {}, {});
    ASSERT_TRUE(hulls.finish());
    hulls.choose_block(0);
    EXPECT_FALSE(hulls.box_of({0, 0, 0}).empty());
    EXPECT_TRUE(hulls.box_of({2, 2, 2}).empty());
    hulls.choose_block(7);
    EXPECT_TRUE(hulls.box_of_block().empty());
    hulls.start(hull_cell);
    hulls.add(Vec3::Zero(), hull_cell, {Vec3::Constant(1e31), Mat3::Zero()}, {});
    EXPECT_FALSE(hulls.finish());
}

}  // namespace
}  // namespace splitcubes::body
