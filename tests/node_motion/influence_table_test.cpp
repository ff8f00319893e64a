// Tables of influences, reduced to those that reach a cube.
#include <splitcubes/core/random.h>
#include <splitcubes/node_motion/influence_table.h>

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <vector>

namespace splitcubes::body {
namespace {

struct Influence {
    Vec3 rest;
    double reach;
    InfluenceTable::State now, before;
};

Vec3 random_within_half(Random& random, double half) {
    const double x = random.uniform(-half, half), y = random.uniform(-half, half);
    return {x, y, random.uniform(-half, half)};
}

InfluenceTable::State random_state(Random& random) {
    InfluenceTable::State state{random_within_half(random, 0.3), Mat3::Zero()};
    for (int k = 0; k < 3; ++k) state.matrix.col(k) = random_within_half(random, 0.5);
    return state;
}

std::vector<Influence> random_influences(Random& random, int count) {
    std::vector<Influence> out;
    for (int k = 0; k < count; ++k)
        out.push_back({random_within_half(random, 1), random.uniform(0.1, 0.4), random_state(random),
                       random_state(random)});
    return out;
}

InfluenceTable table_of(const std::vector<Influence>& influences) {
    InfluenceTable table;
    table.resize(influences.size());
    for (std::size_t i = 0; i < influences.size(); ++i)
        table.set(i, influences[i].rest, influences[i].reach * influences[i].reach, influences[i].now,
                  influences[i].before);
    return table;
}

bool reaches(const Influence& c, const Vec3& centre, double half) {
    return ((c.rest - centre).cwiseAbs() - Vec3::Constant(half)).cwiseMax(0).norm() <= c.reach;
}

TEST(InfluenceTable, NewEntriesReachNothing) {
    InfluenceTable table;
    table.resize(40);
    EXPECT_EQ(table.size(), 40U);
    EXPECT_TRUE(table.box_of({Vec3f::Zero(), 10}).empty());
    table.set(17, Vec3::Zero(), 1, {Vec3(1, 2, 3), Mat3::Zero()}, {Vec3(1, 2, 3), Mat3::Zero()});
    table.resize(100);
    EXPECT_EQ(table.box_of({Vec3f::Zero(), 10}).min, Vec3(1, 2, 3));
}

// A table that was first reduced to a larger cube gives the same box for a smaller one in it.
TEST(InfluenceTable, KeepsExactlyTheEntriesThatReachACube) {
    Random random(1);
    for (int round = 0; round < 50; ++round) {
        const std::vector<Influence> influences =
            random_influences(random, static_cast<int>(random.below(90)));
        const InfluenceTable all = table_of(influences);
        const Vec3 centre = random_within_half(random, 0.6);
        const double half = random.uniform(0.1, 0.3);
        InfluenceTable near, own;
        near.assign_from(all, {centre.cast<float>(), static_cast<float>(half)});
        // In two calls, like rows of bricks.
        const std::size_t middle = random.below(static_cast<std::uint32_t>(influences.size() + 1));
        for (const auto& [begin, end] :
             {std::pair(std::size_t{0}, middle), std::pair(middle, influences.size())})
            own.append_from(all, begin, end, {centre.cast<float>(), static_cast<float>(half)});
        std::size_t expected = 0;
        for (const Influence& c : influences) expected += reaches(c, centre, half) ? 1 : 0;
        EXPECT_EQ(near.size(), expected);
        EXPECT_EQ(own.size(), expected);
        for (int query = 0; query < 10; ++query) {
            const Vec3 arm = random_within_half(random, half);
            const Vec3f at = (centre + arm).cast<float>();
            const geometry::Box box = all.box_of({at, 0}), same = near.box_of({at, 0});
            EXPECT_EQ(box.min, same.min);
            EXPECT_EQ(box.max, same.max);
            geometry::Box exact;
            for (const Influence& c : influences)
                if (reaches(c, centre + arm, 0)) {
                    // In `own`, points and influences are relative to the centre.
                    exact.add(c.now.off + c.now.matrix * (arm - (c.rest - centre)));
                    exact.add(c.before.off + c.before.matrix * (arm - (c.rest - centre)));
                }
            const geometry::Box moved = own.box_of({arm.cast<float>(), 0});
            ASSERT_EQ(moved.empty(), exact.empty());
            if (exact.empty()) continue;
            EXPECT_LT((moved.min - exact.min).norm(), 1e-5);
            EXPECT_LT((moved.max - exact.max).norm(), 1e-5);
        }
    }
}

TEST(InfluenceTable, EveryInstructionSetGivesTheSameBits) {
    Random random(2);
    const InfluenceTable all = table_of(random_influences(random, 300));
    struct Found {
        std::size_t size;
        Mat3 mean;
        Vec3 low, high, node_low, node_high;
        bool operator==(const Found&) const = default;
    };
    const auto run = [&] {
        InfluenceTable own;
        own.append_from(all, 7, 291, {Vec3f(0.1F, 0, 0), 0.5F});
        const Mat3 mean = own.subtract_mean();
        const geometry::Box cube = own.box_of({Vec3f::Zero(), 0.5F}), node = own.box_of({Vec3f::Zero(), 0});
        return Found{own.size(), mean, cube.min, cube.max, node.min, node.max};
    };
    const Found first = run();
    EXPECT_GT(first.size, 50U);
    const std::int64_t supported = hwy::SupportedTargets();
    int tried = 0;
    for (std::int64_t rest = supported; rest != 0; rest &= rest - 1) {
        const std::int64_t target = rest & -rest;
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        EXPECT_TRUE(run() == first) << hwy::TargetName(target);
        ++tried;
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    EXPECT_GT(tried, 1);
}

}  // namespace
}  // namespace splitcubes::body
