// Properties of all criteria, and those of each one.
#include <splitcubes/occlusion/segment_criteria.h>

#include <gtest/gtest.h>

#include "occlusion/scenes.h"

namespace splitcubes::occlusion {
namespace {

using namespace testing;

// Phyxels with all pairs within reach.
struct Cloud {
    std::vector<Vec3> rest;
    std::vector<double> support;
    std::vector<std::int32_t> piece;
    std::vector<std::uint32_t> a, b;

    void link() {
        a.clear();
        b.clear();
        for (std::uint32_t i = 0; i < rest.size(); ++i)
            for (std::uint32_t j = i + 1; j < rest.size(); ++j)
                if ((rest[j] - rest[i]).norm() < std::max(support[i], support[j])) {
                    a.push_back(i);
                    b.push_back(j);
                }
    }
    PairSet set() const { return {rest, support, piece, a, b}; }
};

Cloud lattice(Random& random, int n, double spacing, double jitter) {
    Cloud out;
    for (int k = 0; k < n * n * n; ++k) {
        const Vec3 at(k % n, k / n % n, k / n / n);
        out.rest.push_back(spacing * (at - Vec3::Constant(0.5 * (n - 1))) + random_in_box(random, jitter));
        out.support.push_back(random.uniform(1.8, 2.2) * spacing);
    }
    out.link();
    return out;
}

class Criteria : public ::testing::TestWithParam<CriterionKind> {
  protected:
    std::unique_ptr<Criterion> criterion() const { return make_criterion(GetParam(), make_cpu_backend({})); }
    std::vector<float> evaluate(const geometry::OccluderGrid& grid, const Cloud& cloud,
                                int threads = 1) const {
        std::vector<std::uint32_t> all(cloud.a.size());
        for (std::uint32_t k = 0; k < all.size(); ++k) all[k] = k;
        std::vector<float> out(all.size(), -1.0F);
        criterion()->evaluate(grid, cloud.set(), all, out, Parallel(threads));
        return out;
    }
};

INSTANTIATE_TEST_SUITE_P(All, Criteria,
                         ::testing::Values(CriterionKind::occlusion_disk, CriterionKind::visibility,
                                           CriterionKind::transparency, CriterionKind::graph_distance),
                         [](const auto& which) {
                             std::string name = criterion_names[static_cast<std::size_t>(which.param)];
                             std::replace(name.begin(), name.end(), '-', '_');
                             return name;
                         });

TEST_P(Criteria, UncutIsOne) {
    Random random(41);
    const Cloud cloud = lattice(random, 5, 0.2, 0.04);
    for (const float f : evaluate(grid_of({}), cloud)) EXPECT_EQ(f, 1);
}

TEST_P(Criteria, ACompleteCutIsZeroAcross) {
    Random random(42);
    for (int round = 0; round < repetitions(6); ++round) {
        const Cloud cloud = lattice(random, 5, 0.2, round == 0 ? 0 : 0.04);
        const double at = random.uniform(-0.02, 0.02), tilt = random.uniform(-0.02, 0.02);
        const auto cut = sheet(random, -1.5, 1.5, -1.5, 1.5, 17, [&](double u, double v) {
            return Vec3(at + tilt * u - 0.1 + tilt * v, u, v);
        });
        const auto side = [&](const Vec3& p) { return p[0] < at + tilt * p[1] - 0.1 + tilt * p[2]; };
        const auto factors = evaluate(grid_of(cut), cloud);
        int across = 0;
        for (std::size_t k = 0; k < factors.size(); ++k) {
            const Vec3 &a = cloud.rest[cloud.a[k]], &b = cloud.rest[cloud.b[k]];
            if (side(a) == side(b)) continue;
            EXPECT_EQ(factors[k], 0) << round;
            ++across;
        }
        EXPECT_GT(across, 100);
    }
}

// A random partial cut: all factors are in 0 .. 1, the same for any number of threads and for both orders of
// a pair; some are 0, and except for the visibility criterion some are between 0 and 1.
TEST_P(Criteria, RangeSymmetryAndThreads) {
    Random random(43);
    for (int round = 0; round < repetitions(5); ++round) {
        Cloud cloud = lattice(random, 5, 0.2, 0.04);
        const double front = random.uniform(-0.3, 0.3);
        const auto grid = grid_of(sheet(random, -1.5, front, -1.5, 1.5, 17, [&](double u, double v) {
            return Vec3(0.05 * std::sin(4 * u + 3 * v) - 0.1, u, v);
        }));
        const auto factors = evaluate(grid, cloud);
        EXPECT_EQ(factors, evaluate(grid, cloud, 3));
        int low = 0, between = 0;
        for (const float f : factors) {
            EXPECT_GE(f, 0);
            EXPECT_LE(f, 1);
            low += f == 0;
            between += f > 0 && f < 1;
        }
        EXPECT_GT(low, 0);
        if (GetParam() == CriterionKind::visibility)
            EXPECT_EQ(between, 0);
        else
            EXPECT_GT(between, 0);
        // The same phyxels in the opposite order.
        Cloud turned = cloud;
        std::reverse(turned.rest.begin(), turned.rest.end());
        std::reverse(turned.support.begin(), turned.support.end());
        turned.link();
        const auto again = evaluate(grid, turned);
        const auto last = static_cast<std::uint32_t>(cloud.rest.size() - 1);
        std::size_t found = 0;
        for (std::size_t k = 0; k < factors.size(); ++k)
            for (std::size_t t = 0; t < again.size(); ++t)
                if (turned.a[t] == last - cloud.b[k] && turned.b[t] == last - cloud.a[k]) {
                    // Lengths of paths are summed from the other end.
                    EXPECT_NEAR(factors[k], again[t], GetParam() == CriterionKind::graph_distance ? 1e-6 : 0);
                    ++found;
                    break;
                }
        EXPECT_EQ(found, factors.size());
    }
}

// Triangles that do not meet a pair's region do not change its factor.
TEST_P(Criteria, TrianglesOutsideTheRegionDoNotMatter) {
    Random random(44);
    const Cloud cloud = lattice(random, 4, 0.2, 0.04);
    const auto one = criterion();
    for (int round = 0; round < repetitions(30); ++round) {
        Triangles triangles = sheet(random, -1.5, random.uniform(-0.2, 0.3), -1.5, 1.5, 13,
                                    [&](double u, double v) { return Vec3(0.03 * u * v, u, v); });
        const auto before = evaluate(grid_of(triangles), cloud);
        const Vec3 c = random_in_box(random, 0.3);
        Triangles more = triangles;
        more.push_back({{c, c + random_in_box(random, 0.2), c + random_in_box(random, 0.2)}, false});
        const auto after = evaluate(grid_of(more), cloud);
        const geometry::Box changed = more.back().bounds();
        for (std::size_t k = 0; k < before.size(); ++k)
            if (!one->region(cloud.set(), k).meets(changed)) {
                EXPECT_EQ(before[k], after[k]);
            }
    }
}

TEST(VisibilityCriterion, IsAJump) {
    Random random(45);
    Cloud cloud;
    cloud.rest = {{-0.1, 0, 0}, {0.1, 0, 0}};
    cloud.support = {0.4, 0.4};
    cloud.link();
    const std::uint32_t pair = 0;
    for (const double front : {-0.01, 0.01}) {
        float f = -1;
        make_criterion(CriterionKind::visibility, nullptr)
            ->evaluate(
                grid_of(sheet(random, -1, front, -1, 1, 4, [](double u, double v) { return Vec3(0, u, v); })),
                cloud.set(), {&pair, 1}, {&f, 1}, Parallel(1));
        EXPECT_EQ(f, front < 0 ? 1.0F : 0.0F);
    }
}

// With d the depth of the crossing behind the front, r is replaced by r + h (2 d / h)^2.
TEST(TransparencyCriterion, FallsWithTheDepthBehindTheFront) {
    Random random(46);
    const double h = 0.5, r = 0.2;
    const PairQuery pair{{-r / 2, 0.01, 0.02}, {r / 2, 0.01, 0.02}};
    for (const double depth : {0.02, 0.05, 0.1, 0.15, 0.2, 0.24, 0.4}) {
        const auto grid = grid_of(
            sheet(random, -1, 0.01 + depth, -1, 1, 9, [](double u, double v) { return Vec3(0, u, v); }));
        const double counts_as = r + h * std::pow(2 * depth / h, 2);
        const double expected =
            counts_as < h ? std::pow((h * h - counts_as * counts_as) / (h * h - r * r), 3) : 0.0;
        EXPECT_NEAR(transparency_factor(grid, pair, h), expected, 1e-9) << depth;
        // The boundary is opaque.
        auto boundary =
            sheet(random, -1, 0.01 + depth, -1, 1, 9, [](double u, double v) { return Vec3(0, u, v); });
        for (auto& t : boundary) t.boundary = true;
        EXPECT_EQ(transparency_factor(grid_of(boundary), pair, h), 0);
    }
    EXPECT_EQ(transparency_factor(grid_of({}), pair, h), 1);
}

TEST(GraphCriterion, GoesAroundTheFront) {
    Random random(47);
    Cloud cloud;
    cloud.rest = {{-0.1, 0, 0}, {0.1, 0, 0}, {0, 0.15, 0}};
    cloud.support = {0.5, 0.5, 0.5};
    cloud.link();
    const auto grid =
        grid_of(sheet(random, -1, 0.1, -1, 1, 7, [](double u, double v) { return Vec3(0.01, u, v); }));
    const std::uint32_t all[] = {0, 1, 2};
    float f[3];
    const auto criterion = make_criterion(CriterionKind::graph_distance, nullptr);
    criterion->evaluate(grid, cloud.set(), all, f, Parallel(1));
    const double around = 2 * std::hypot(0.1, 0.15);
    EXPECT_NEAR(f[0], std::pow((0.25 - around * around) / (0.25 - 0.04), 3), 1e-6);
    EXPECT_EQ(f[1], 1);
    EXPECT_EQ(f[2], 1);
    // The third phyxel is in a separate piece: there is no path around.
    cloud.piece = {0, 0, 1};
    criterion->evaluate(grid, cloud.set(), {all, 1}, {f, 1}, Parallel(1));
    EXPECT_EQ(f[0], 0);
}

TEST(WeightRatio, IsThatOfTheKernel) {
    EXPECT_EQ(weight_ratio(0.3, 0.3, 1), 1);
    EXPECT_EQ(weight_ratio(0.3, 1.0, 1), 0);
    EXPECT_EQ(weight_ratio(1.2, 1.2, 1), 0);
    EXPECT_EQ(weight_ratio(0.3, std::numeric_limits<double>::infinity(), 1), 0);
    EXPECT_NEAR(weight_ratio(0, 0.5, 1), 0.421875, 1e-15);
    EXPECT_NEAR(weight_ratio(0, 1, 2), 0.421875, 1e-15);
}

}  // namespace
}  // namespace splitcubes::occlusion
