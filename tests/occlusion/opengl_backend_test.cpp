// Rendered tiles compared with rays in double precision, sample by sample, and queries compared with texels.
#ifdef SPLITCUBES_WITH_RENDER

#include <splitcubes/core/error.h>
#include <splitcubes/occlusion/brute_force.h>

#include <gtest/gtest.h>

#include <bit>

#include "occlusion/opengl.h"
#include "occlusion/scenes.h"

namespace splitcubes::occlusion {
namespace {

using namespace testing;

class OpenGl : public ::testing::Test {
  protected:
    void SetUp() override {
        if (!opengl_starts()) GTEST_SKIP() << no_opengl_because();
    }
};

// Returns triangles of a few sizes in and around the cones; some closed boundaries.
Triangles scene_of(Random& random, const PairQuery& pair) {
    Triangles out;
    if (random.below(2)) {
        const Vec3 centre = 0.5 * (pair.a + pair.b);
        out = box_boundary(random, centre - Vec3::Constant(random.uniform(0.2, 0.6)),
                           centre + Vec3::Constant(random.uniform(0.2, 0.6)),
                           1 + static_cast<int>(random.below(5)));
        out = moved(out, motion_of(random_turn(random), random_in_box(random, 0.1)));
    }
    const int count = static_cast<int>(random.below(60));
    for (int k = 0; k < count; ++k) {
        const double size = std::pow(10.0, random.uniform(-2, 0.2));
        const Vec3 centre = random_in_box(random, 0.7);
        geometry::OccluderTriangle t;
        for (Vec3& p : t.corner) p = centre + random_in_box(random, size);
        out.push_back(t);
    }
    return out;
}

using Local = std::array<Vec3, 3>;

struct Rays {
    std::vector<Local> seen[2];
    std::vector<bool> boundary;

    Rays(const Triangles& triangles, const PairQuery& pair) {
        const Disk disk = make_disk(pair);
        for (const auto& t : triangles) {
            Local first, second;
            for (std::size_t k = 0; k < 3; ++k) {
                first[k] = second[k] = disk.local(t.corner[k]);
                second[k][2] = 2 - second[k][2];
            }
            seen[0].push_back(first);
            seen[1].push_back(second);
            boundary.push_back(t.boundary);
        }
    }
    // Returns bit 0: obscured, bit 1: outside. depth: scales both ends.
    int state(double x, double y, double depth) const {
        bool obscured = false, odd = false;
        const Vec3 ray = Vec3(x, y, 1);
        for (std::size_t apex = 0; apex < 2; ++apex)
            for (std::size_t k = 0; k < seen[apex].size(); ++k) {
                obscured = obscured || geometry::segment_meets_triangle(
                                           near_depth * depth * ray, far_depth * depth * ray, seen[apex][k]);
                if (apex == 0 && boundary[k] &&
                    (ray_crosses(seen[0][k], x, y, 1) || ray_crosses(seen[0][k], x, y, -1)))
                    odd = !odd;
            }
        return (obscured ? 1 : 0) | (odd ? 2 : 0);
    }
    // Returns whether rays next to the sample's, by a few of the driver's subpixels or roundings of depth,
    // have different results.
    bool doubtful(double x, double y, int size) const {
        const int here = state(x, y, 1);
        for (const double depth : {1 - 1e-4, 1 + 1e-4})
            if (state(x, y, depth) != here) return true;
        for (const double texels : {0.25, 1.0, 3.0})
            for (int k = 0; k < 12; ++k) {
                const double angle = k * std::numbers::pi / 6, step = texels / 256 * 2 / size;
                if (state(x + step * std::cos(angle), y + step * std::sin(angle), 1) != here) return true;
            }
        return false;
    }
};

TEST_F(OpenGl, EqualsBruteForceButWithinRoundingOfEdges) {
    Random random(31);
    int samples = 0, differing = 0, unexplained = 0, covered = 0;
    for (const int size : {8, 16, 32}) {
        const DiskRaster raster(size);
        const auto backend = opengl_backend({.disk_size = size});
        for (int round = 0; round < repetitions(size == 32 ? 60 : 150); ++round) {
            const PairQuery pair{random_in_box(random, 0.4), random_in_box(random, 0.4)};
            const Triangles triangles = scene_of(random, pair);
            const auto grid = grid_of(triangles);
            const DiskMasks drawn = backend->masks(grid, {&pair, 1}, Parallel(1))[0];
            const DiskMasks slow = brute_force_masks(grid, pair, raster);
            const Rays rays(triangles, pair);
            for (int bit = 0; bit < size * size; ++bit) {
                const auto w = static_cast<std::size_t>(bit) / 64;
                const std::uint64_t flag = std::uint64_t{1} << (bit % 64);
                if (!(raster.samples[w] & flag)) continue;
                ++samples;
                const bool odd = (slow.outside[w] & flag) != 0;
                const bool same_side = odd == ((drawn.outside[w] & flag) != 0);
                // Only samples inside are drawn as obscured.
                const bool is_obscured = (slow.obscured[w] & flag) != 0;
                covered += is_obscured;
                if (same_side && (odd || is_obscured == ((drawn.obscured[w] & flag) != 0))) continue;
                ++differing;
                if (!rays.doubtful(raster.coordinate(bit % size), raster.coordinate(bit / size), size))
                    ++unexplained;
            }
        }
    }
    RecordProperty("samples", samples);
    RecordProperty("differing", differing);
    std::cout << differing << " of " << samples << " samples differ, " << covered << " obscured\n";
    EXPECT_EQ(unexplained, 0);
    EXPECT_GT(covered, samples / 20);
    // Edges pass within a subpixel of a sample about that often.
    EXPECT_LE(differing, samples / 300);
}

TEST_F(OpenGl, QueriesEqualTexels) {
    Random random(32);
    Triangles triangles = box_boundary(random, {-0.8, -0.8, -0.8}, {0.8, 0.8, 0.8}, 8);
    for (int k = 0; k < 300; ++k) {
        const Vec3 c = random_in_box(random, 0.8);
        triangles.push_back({{c, c + random_in_box(random, 0.2), c + random_in_box(random, 0.2)}, false});
    }
    const auto grid = grid_of(triangles);
    std::vector<PairQuery> pairs;
    for (int k = 0; k < repetitions(1500); ++k) {
        const Vec3 a = random_in_box(random, 0.8);
        pairs.push_back({a, a + random_in_box(random, 0.4)});
    }
    std::vector<float> queried(pairs.size()), counted(pairs.size()), small(pairs.size());
    const auto checked = opengl_backend({}, {.check_queries = true});
    checked->evaluate(grid, pairs, counted, Parallel(2));
    std::cout << checked->statistics().wrong_counts << " wrong of " << checked->statistics().queries
              << " queries\n";
    EXPECT_GT(checked->statistics().queries, pairs.size());
    EXPECT_EQ(checked->statistics().wrong_counts, 0U);
    opengl_backend()->evaluate(grid, pairs, queried, Parallel(1));
    EXPECT_EQ(queried, counted);
    // Neither the batches nor the counting method change a bit.
    const auto texels = opengl_backend({}, {.atlas_size = 64, .count_texels = true});
    texels->evaluate(grid, pairs, small, Parallel(1));
    EXPECT_EQ(texels->statistics().queries, 0U);
    EXPECT_EQ(small, counted);
}

TEST_F(OpenGl, LiesCloseToTheCpuBackend) {
    Random random(33);
    const Triangles triangles = sheet(random, -1, 0.1, -1, 1, 12, [](double u, double v) {
        return Vec3(u, v, 0.1 * std::sin(7 * u + 5 * v));
    });
    const auto grid = grid_of(triangles);
    std::vector<PairQuery> pairs;
    for (int k = 0; k < repetitions(1000); ++k) {
        const Vec3 a = random_in_box(random, 0.7);
        pairs.push_back({a, a + random_in_box(random, 0.5)});
    }
    std::vector<float> drawn(pairs.size()), exact(pairs.size());
    opengl_backend()->evaluate(grid, pairs, drawn, Parallel(1));
    make_cpu_backend({})->evaluate(grid, pairs, exact, Parallel(1));
    double total = 0;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        EXPECT_NEAR(drawn[k], exact[k], 6.0 / 208) << k;
        total += std::abs(drawn[k] - exact[k]);
    }
    EXPECT_LE(total / static_cast<double>(pairs.size()), 0.25 / 208);
}

TEST(OpenGlCounts, ImpossibleOnesAreDetected) {
    const DiskRaster raster(16);
    EXPECT_TRUE(are_counts_possible({208, 208}, raster));
    EXPECT_TRUE(are_counts_possible({208, 0}, raster));
    EXPECT_TRUE(are_counts_possible({0, 0}, raster));
    EXPECT_FALSE(are_counts_possible({209, 5}, raster));
    EXPECT_FALSE(are_counts_possible({208, -1}, raster));
    EXPECT_FALSE(are_counts_possible({62199, 62199}, raster));
    EXPECT_FALSE(are_counts_possible({5, 6}, raster));
}

TEST_F(OpenGl, OptionsOutOfRangeAreRefused) {
    for (const int size : {0, 16, 100, 1024, -32})
        EXPECT_THROW(opengl_backend({}, {.atlas_size = size}), InputError);
    EXPECT_THROW(opengl_backend({.disk_size = 12}), InputError);
}

// The result does not depend on the state that another user of the context left set.
TEST_F(OpenGl, WorksWithAnyContextState) {
    Random random(34);
    const PairQuery pair{{0, 0, -0.5}, {0, 0, 0.5}};
    const auto grid =
        grid_of(sheet(random, -1, 0.1, -1, 1, 5, [](double u, double v) { return Vec3(u, v, 0); }));
    const auto backend = opengl_backend();
    float before = -1, after = -1;
    backend->evaluate(grid, {&pair, 1}, {&before, 1}, Parallel(1));
    const auto other = gl::HeadlessContext::create();
    ASSERT_TRUE(other.has_value());
    other->make_current();
    backend->evaluate(grid, {&pair, 1}, {&after, 1}, Parallel(1));
    EXPECT_EQ(before, after);
    EXPECT_LT(before, 1);
}

}  // namespace
}  // namespace splitcubes::occlusion

#endif
