// The search for facing samples, compared with brute force.
#include <splitcubes/contact/detection/sample_grid.h>
#include <splitcubes/core/random.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace splitcubes::body {
namespace {

Vec3 random_within(Random& random, double half) {
    return {random.uniform(-half, half), random.uniform(-half, half), random.uniform(-half, half)};
}

constexpr double unlimited = std::numeric_limits<double>::infinity();

// Returns by how much the point `of` moves away from point k along a normal in the step, at least.
double away(const std::vector<SampleGrid::Motion>& motions, const Vec3& normal, std::size_t of,
            std::size_t k) {
    return normal.dot(motions[of].displacement - motions[k].displacement) +
           std::min(0.0, normal.dot(motions[of].drift - motions[k].drift));
}

struct Cloud {
    std::vector<Vec3> points, normals;
    std::vector<SampleGrid::Motion> motions;
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
            motions.push_back({random_within(random, 0.1), random_within(random, 0.1)});
    }
    // Gives one in `of` points an extra reach of up to `max_extra` (m), the others little.
    void add_extra_reach(Random& random, int of, double max_extra) {
        for (std::size_t k = 0; k < motions.size(); ++k)
            motions[k].extra_reach =
                max_extra * (random.uniform(0, 1) * of < 1 ? random.uniform(0, 1) : random.uniform(0, 0.02));
    }
    std::vector<std::uint32_t> facing(std::size_t of, double radius, const SampleGrid::Reach& reach) const {
        std::vector<std::uint32_t> out;
        for (std::uint32_t k = 0; k < points.size(); ++k) {
            const double limit =
                std::min({radius, reach.min + motions[of].extra_reach + motions[k].extra_reach, reach.max});
            if ((points[k] - points[of]).norm() < limit && normals[k].dot(normals[of]) < facing_cosine)
                out.push_back(k);
        }
        return out;
    }
    std::vector<std::uint32_t> facing(std::size_t of, double radius) const {
        return facing(of, radius, {radius, radius});
    }
    // Returns the minimum height of a point above the planes through others, after the step.
    double min_height(std::size_t of, const std::vector<std::uint32_t>& others) const {
        double min_found = unlimited;
        for (const std::uint32_t k : others)
            min_found = std::min(min_found,
                                 normals[k].dot(points[of] - points[k]) + away(motions, normals[k], of, k));
        return min_found;
    }
};

// Returns the indices of the points, ascending.
std::vector<std::uint32_t> find_facing(const SampleGrid& grid, const std::vector<SampleGrid::Motion>& motions,
                                       std::size_t entry, double radius, double height) {
    std::vector<std::uint32_t> scratch, out;
    std::vector<SampleGrid::FacingPoint> faced;
    grid.find_facing(entry, radius, height, scratch, faced);
    for (const SampleGrid::FacingPoint& other : faced) {
        const Vec3 offset = grid.point(entry) - grid.point(other.entry);
        EXPECT_EQ(other.squared_distance, offset.squaredNorm());
        EXPECT_EQ(other.cosine, grid.normal(entry).dot(grid.normal(other.entry)));
        EXPECT_EQ(other.height, grid.normal(other.entry).dot(offset));
        EXPECT_NEAR(other.end_height - other.height,
                    away(motions, grid.normal(other.entry), grid.index(entry), grid.index(other.entry)),
                    1e-12);
        out.push_back(grid.index(other.entry));
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
        grid.build(cloud.points, cloud.normals, cloud.motions, cloud.owners, {reach, reach}, Parallel(2));
        for (std::size_t entry = 0; entry < grid.size(); ++entry) {
            const std::size_t of = grid.index(entry);
            const std::vector<std::uint32_t> facing = cloud.facing(of, reach);
            const bool others = std::any_of(facing.begin(), facing.end(), [&](std::uint32_t k) {
                return cloud.owners[k] != cloud.owners[of];
            });
            EXPECT_FALSE(others && grid.is_among_own(entry));
            among_own += grid.is_among_own(entry);
            among_others += others;
        }
    }
    EXPECT_GT(among_own, 50U);
    EXPECT_GT(among_others, 10U);
}

TEST(SampleGrid, FindsExactlyThePointsThatFaceAnother) {
    SampleGrid grid;
    Random random(77);
    std::size_t found = 0, not_facing = 0, left_out = 0, too_high_count = 0;
    for (const double reach : {0.05, 0.2, 0.33, 0.6})
        for (std::uint64_t seed = 1; seed <= 5; ++seed) {
            const Cloud cloud(seed);
            grid.build(cloud.points, cloud.normals, cloud.motions, cloud.owners, {reach, reach}, Parallel(2));
            std::vector<bool> is_kept(cloud.points.size());
            for (std::size_t entry = 0; entry < grid.size(); ++entry) {
                const std::size_t of = grid.index(entry);
                ASSERT_FALSE(is_kept[of]);
                is_kept[of] = true;
                ASSERT_EQ(grid.point(entry), cloud.points[of]);
                ASSERT_EQ(grid.normal(entry), cloud.normals[of]);
                for (const double radius : {0.25 * reach, 0.7 * reach, reach}) {
                    const std::vector<std::uint32_t> expected = cloud.facing(of, radius);
                    ASSERT_EQ(find_facing(grid, cloud.motions, entry, radius, unlimited), expected)
                        << "seed " << seed << ", point " << of << ", radius " << radius;
                    ASSERT_TRUE(expected.empty() || grid.may_face(entry));
                    const double height = radius * random.uniform(-1, 1);
                    const std::vector<std::uint32_t> facing_low =
                        find_facing(grid, cloud.motions, entry, radius, height);
                    if (facing_low.empty()) {
                        ASSERT_GE(cloud.min_height(of, expected), height);
                        too_high_count += !expected.empty();
                    } else {
                        ASSERT_EQ(facing_low, expected);
                    }
                    found += expected.size();
                }
                not_facing += !grid.may_face(entry);
            }
            for (std::size_t of = 0; of < cloud.points.size(); ++of) {
                if (is_kept[of]) continue;
                ASSERT_TRUE(cloud.facing(of, reach).empty());
                ++left_out;
            }
        }
    // The cases occur often enough for the test to mean something.
    EXPECT_GT(too_high_count, 300U);
    EXPECT_GT(found, 1000U);
    EXPECT_GT(not_facing, 300U);
    EXPECT_GT(left_out, 1000U);
}

TEST(SampleGrid, ExtendsTheReachByTheMotionOfBothPoints) {
    SampleGrid grid;
    Random random(5);
    std::size_t far_count = 0, left_out = 0;
    for (const int of : {1, 10, 100})
        for (std::uint64_t seed = 1; seed <= 12; ++seed) {
            Cloud cloud(seed);
            const double min_reach = random.uniform(0.03, 0.3);
            const SampleGrid::Reach reach{min_reach, min_reach * random.uniform(1.2, 3)};
            cloud.add_extra_reach(random, of, random.uniform(0.1, 3) * min_reach);
            // A few distant points make the cells larger.
            if (seed > 3) cloud.points[seed] = cloud.points[0] + random_within(random, 40 * min_reach);
            if (seed > 6) cloud.points[2 * seed] = cloud.points[0] + random_within(random, 150 * min_reach);
            grid.build(cloud.points, cloud.normals, cloud.motions, cloud.owners, reach, Parallel(2));
            std::vector<bool> is_kept(cloud.points.size());
            for (std::size_t entry = 0; entry < grid.size(); ++entry) {
                const std::size_t of_point = grid.index(entry);
                is_kept[of_point] = true;
                for (const double radius : {0.7 * min_reach, 0.8 * reach.max, unlimited}) {
                    const std::vector<std::uint32_t> expected = cloud.facing(of_point, radius, reach);
                    ASSERT_EQ(find_facing(grid, cloud.motions, entry, radius, unlimited), expected)
                        << "seed " << seed << ", point " << of_point << ", radius " << radius;
                    ASSERT_TRUE(expected.empty() || grid.may_face(entry));
                    for (const std::uint32_t k : expected) {
                        far_count += (cloud.points[k] - cloud.points[of_point]).norm() > 1.5 * min_reach;
                        ASSERT_FALSE(cloud.owners[k] != cloud.owners[of_point] && grid.is_among_own(entry));
                    }
                }
            }
            for (std::size_t point = 0; point < cloud.points.size(); ++point) {
                if (is_kept[point]) continue;
                ASSERT_TRUE(cloud.facing(point, unlimited, reach).empty());
                ++left_out;
            }
        }
    EXPECT_GT(far_count, 1000U);
    EXPECT_GT(left_out, 500U);
}

TEST(SampleGrid, ToleratesNaNAndFarPoints) {
    for (const double far : {1e6, 1e25, 1e300, -1e6, -1e25, -1e300}) {
        Cloud cloud(1);
        cloud.points[3].x() = std::numeric_limits<double>::quiet_NaN();
        cloud.points[5].y() = far;
        SampleGrid grid;
        grid.build(cloud.points, cloud.normals, cloud.motions, cloud.owners, {0.4, 0.4}, Parallel(1));
        for (std::size_t entry = 0; entry < grid.size(); ++entry)
            EXPECT_EQ(find_facing(grid, cloud.motions, entry, 0.4, unlimited),
                      cloud.facing(grid.index(entry), 0.4));
    }
}

}  // namespace
}  // namespace splitcubes::body
