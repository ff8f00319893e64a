// The search for facing samples, compared with brute force.
#include <splitcubes/body/sample_grid.h>
#include <splitcubes/core/random.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace splitcubes::body {
namespace {

Vec3 random_within(Random& random, double half) {
    return {random.uniform(-half, half), random.uniform(-half, half), random.uniform(-half, half)};
}

constexpr double anywhere = std::numeric_limits<double>::infinity();

// Returns by how much the point `of` moves away from point k along a normal in the step, at least.
double away(const std::vector<SampleGrid::Way>& ways, const Vec3& normal, std::size_t of, std::size_t k) {
    return normal.dot(ways[of].sure - ways[k].sure) + std::min(0.0, normal.dot(ways[of].more - ways[k].more));
}

struct Cloud {
    std::vector<Vec3> points, normals;
    std::vector<SampleGrid::Way> ways;
    std::vector<std::uint16_t> owners;  // each owns two of the patches and a third of the other points

    // Points of a few patches with similar normals, and some random ones.
    explicit Cloud(std::uint64_t seed) {
        Random random(seed);
        for (int patch = 0; patch < 6; ++patch) {
            const Vec3 centre = random_within(random, 1), normal = random_within(random, 1).normalized();
            for (int k = 0; k < 60; ++k) {
                points.emplace_back(centre + random_within(random, 0.3));
                normals.emplace_back((normal + random_within(random, 0.3)).normalized());
                owners.push_back(static_cast<std::uint16_t>(patch / 2));
            }
        }
        for (int k = 0; k < 40; ++k) {
            points.push_back(random_within(random, 2));
            normals.emplace_back(random_within(random, 1).normalized());
            owners.push_back(static_cast<std::uint16_t>(k % 3));
        }
        for (std::size_t k = 0; k < points.size(); ++k)
            ways.push_back({random_within(random, 0.1), random_within(random, 0.1)});
    }
    // Gives one in `of` points an extra reach of up to `most` (m), the others little.
    void make_fast(Random& random, int of, double most) {
        for (std::size_t k = 0; k < ways.size(); ++k)
            ways[k].farther =
                most * (random.uniform(0, 1) * of < 1 ? random.uniform(0, 1) : random.uniform(0, 0.02));
    }
    std::vector<std::uint32_t> facing(std::size_t of, double radius, const SampleGrid::Reach& reach) const {
        std::vector<std::uint32_t> out;
        for (std::uint32_t k = 0; k < points.size(); ++k) {
            const double limit =
                std::min({radius, reach.least + ways[of].farther + ways[k].farther, reach.most});
            if ((points[k] - points[of]).norm() < limit && normals[k].dot(normals[of]) < facing_cosine)
                out.push_back(k);
        }
        return out;
    }
    std::vector<std::uint32_t> facing(std::size_t of, double radius) const {
        return facing(of, radius, {radius, radius});
    }
    // Returns the minimum height of a point above the planes through others, after the step.
    double least_height(std::size_t of, const std::vector<std::uint32_t>& others) const {
        double least = anywhere;
        for (const std::uint32_t k : others)
            least = std::min(least, normals[k].dot(points[of] - points[k]) + away(ways, normals[k], of, k));
        return least;
    }
};

// Returns the indices of the points, ascending.
std::vector<std::uint32_t> find_facing(const SampleGrid& grid, const std::vector<SampleGrid::Way>& ways,
                                       std::size_t place, double radius, double height) {
    std::vector<std::uint32_t> scratch, out;
    std::vector<SampleGrid::Faced> faced;
    grid.find_facing(place, radius, height, scratch, faced);
    for (const SampleGrid::Faced& other : faced) {
        const Vec3 way = grid.point(place) - grid.point(other.place);
        EXPECT_EQ(other.square, way.squaredNorm());
        EXPECT_EQ(other.cosine, grid.normal(place).dot(grid.normal(other.place)));
        EXPECT_EQ(other.along, grid.normal(other.place).dot(way));
        EXPECT_NEAR(other.next - other.along,
                    away(ways, grid.normal(other.place), grid.number(place), grid.number(other.place)),
                    1e-12);
        out.push_back(grid.number(other.place));
    }
    std::sort(out.begin(), out.end());
    return out;
}

TEST(SampleGrid, IsAmongOwnOnlyWhereNoOtherOwnerIsInReach) {
    SampleGrid grid;
    std::size_t among_own = 0, among_others = 0;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        const Cloud cloud(seed);
        const double reach = 0.1;
        grid.build(cloud.points, cloud.normals, cloud.ways, cloud.owners, {reach, reach}, Parallel(2));
        for (std::size_t place = 0; place < grid.size(); ++place) {
            const std::size_t of = grid.number(place);
            const std::vector<std::uint32_t> facing = cloud.facing(of, reach);
            const bool others = std::any_of(facing.begin(), facing.end(), [&](std::uint32_t k) {
                return cloud.owners[k] != cloud.owners[of];
            });
            EXPECT_FALSE(others && grid.is_among_own(place));
            among_own += grid.is_among_own(place);
            among_others += others;
        }
    }
    EXPECT_GT(among_own, 50U);
    EXPECT_GT(among_others, 10U);
}

TEST(SampleGrid, FindsExactlyThePointsThatFaceAnother) {
    SampleGrid grid;
    Random random(77);
    std::size_t found = 0, passed_over = 0, left_out = 0, too_high = 0;
    for (const double reach : {0.05, 0.2, 0.33, 0.6})
        for (std::uint64_t seed = 1; seed <= 5; ++seed) {
            const Cloud cloud(seed);
            grid.build(cloud.points, cloud.normals, cloud.ways, cloud.owners, {reach, reach}, Parallel(2));
            std::vector<bool> is_known(cloud.points.size());
            for (std::size_t place = 0; place < grid.size(); ++place) {
                const std::size_t of = grid.number(place);
                ASSERT_FALSE(is_known[of]);
                is_known[of] = true;
                ASSERT_EQ(grid.point(place), cloud.points[of]);
                ASSERT_EQ(grid.normal(place), cloud.normals[of]);
                for (const double radius : {0.25 * reach, 0.7 * reach, reach}) {
                    const std::vector<std::uint32_t> expected = cloud.facing(of, radius);
                    ASSERT_EQ(find_facing(grid, cloud.ways, place, radius, anywhere), expected)
                        << "seed " << seed << ", point " << of << ", radius " << radius;
                    ASSERT_TRUE(expected.empty() || grid.may_face(place));
                    const double height = radius * random.uniform(-1, 1);
                    const std::vector<std::uint32_t> low =
                        find_facing(grid, cloud.ways, place, radius, height);
                    if (low.empty()) {
                        ASSERT_GE(cloud.least_height(of, expected), height);
                        too_high += !expected.empty();
                    } else {
                        ASSERT_EQ(low, expected);
                    }
                    found += expected.size();
                }
                passed_over += !grid.may_face(place);
            }
            for (std::size_t of = 0; of < cloud.points.size(); ++of) {
                if (is_known[of]) continue;
                ASSERT_TRUE(cloud.facing(of, reach).empty());
                ++left_out;
            }
        }
    // The cases occur often enough for the test to mean something.
    EXPECT_GT(too_high, 300U);
    EXPECT_GT(found, 1000U);
    EXPECT_GT(passed_over, 300U);
    EXPECT_GT(left_out, 1000U);
}

TEST(SampleGrid, ExtendsTheReachByTheMotionOfBothPoints) {
    SampleGrid grid;
    Random random(5);
    std::size_t farther = 0, left_out = 0;
    for (const int of : {1, 10, 100})
        for (std::uint64_t seed = 1; seed <= 12; ++seed) {
            Cloud cloud(seed);
            const double least = random.uniform(0.03, 0.3);
            const SampleGrid::Reach reach{least, least * random.uniform(1.2, 3)};
            cloud.make_fast(random, of, random.uniform(0.1, 3) * least);
            // A few distant points make the cells larger.
            if (seed > 3) cloud.points[seed] = cloud.points[0] + random_within(random, 40 * least);
            if (seed > 6) cloud.points[2 * seed] = cloud.points[0] + random_within(random, 150 * least);
            grid.build(cloud.points, cloud.normals, cloud.ways, cloud.owners, reach, Parallel(2));
            std::vector<bool> is_known(cloud.points.size());
            for (std::size_t place = 0; place < grid.size(); ++place) {
                const std::size_t of_point = grid.number(place);
                is_known[of_point] = true;
                for (const double radius : {0.7 * least, 0.8 * reach.most, anywhere}) {
                    const std::vector<std::uint32_t> expected = cloud.facing(of_point, radius, reach);
                    ASSERT_EQ(find_facing(grid, cloud.ways, place, radius, anywhere), expected)
                        << "seed " << seed << ", point " << of_point << ", radius " << radius;
                    ASSERT_TRUE(expected.empty() || grid.may_face(place));
                    for (const std::uint32_t k : expected) {
                        farther += (cloud.points[k] - cloud.points[of_point]).norm() > 1.5 * least;
                        ASSERT_FALSE(cloud.owners[k] != cloud.owners[of_point] && grid.is_among_own(place));
                    }
                }
            }
            for (std::size_t point = 0; point < cloud.points.size(); ++point) {
                if (is_known[point]) continue;
                ASSERT_TRUE(cloud.facing(point, anywhere, reach).empty());
                ++left_out;
            }
        }
    EXPECT_GT(farther, 1000U);
    EXPECT_GT(left_out, 500U);
}

TEST(SampleGrid, ToleratesNaNAndFarPoints) {
    for (const double far : {1e6, 1e25, 1e300, -1e6, -1e25, -1e300}) {
        Cloud cloud(1);
        cloud.points[3].x() = std::numeric_limits<double>::quiet_NaN();
        cloud.points[5].y() = far;
        SampleGrid grid;
        grid.build(cloud.points, cloud.normals, cloud.ways, cloud.owners, {0.4, 0.4}, Parallel(1));
        for (std::size_t place = 0; place < grid.size(); ++place)
            EXPECT_EQ(find_facing(grid, cloud.ways, place, 0.4, anywhere),
                      cloud.facing(grid.number(place), 0.4));
    }
}

}  // namespace
}  // namespace splitcubes::body
