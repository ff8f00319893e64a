// Properties of visibilities, for all backends.
#include <splitcubes/core/error.h>
#include <splitcubes/occlusion/visibility.h>

#include <gtest/gtest.h>

#include "occlusion/opengl.h"
#include "occlusion/scenes.h"

namespace splitcubes::occlusion {
namespace {

using namespace testing;

enum class Backend { cpu, brute_force, opengl };

class Visibility : public ::testing::TestWithParam<Backend> {
  protected:
    void SetUp() override {
        if (GetParam() == Backend::opengl && !opengl_starts()) GTEST_SKIP() << no_opengl_because();
    }
    std::unique_ptr<VisibilityBackend> backend(const VisibilityOptions& options = {}) const {
        if (GetParam() == Backend::opengl) return opengl_backend(options);
        return GetParam() == Backend::cpu ? make_cpu_backend(options) : make_brute_force_backend(options);
    }
    float evaluate(const Triangles& triangles, const PairQuery& pair,
                   const VisibilityOptions& options = {}) const {
        float out = -1;
        backend(options)->evaluate(grid_of(triangles), {&pair, 1}, {&out, 1}, Parallel(1));
        return out;
    }
    int repeats(int count) const { return repetitions(GetParam() == Backend::cpu ? count : count / 20 + 1); }
};

INSTANTIATE_TEST_SUITE_P(Backends, Visibility,
                         ::testing::Values(Backend::cpu, Backend::brute_force, Backend::opengl),
                         [](const auto& which) {
                             return which.param == Backend::cpu           ? "cpu"
                                    : which.param == Backend::brute_force ? "brute_force"
                                                                          : "opengl";
                         });

// Returns the visible part of the unit disk beside a half-plane whose edge is at s.
double uncovered_fraction(double s) {
    return 0.5 - (std::asin(s) + s * std::sqrt(1 - s * s)) / std::numbers::pi;
}

TEST_P(Visibility, NothingBetweenIsFullyVisible) {
    EXPECT_EQ(evaluate({}, {{0, 0, 0}, {1, 0, 0}}), 1);
    EXPECT_EQ(evaluate({}, {{0, 0, 0}, {0, 0, 0}}), 1);
    Random random(1);
    // A sheet behind a phyxel does not count.
    const auto behind = sheet(random, -2, 2, -2, 2, 5, [](double u, double v) { return Vec3(u, v, -0.7); });
    EXPECT_EQ(evaluate(behind, {{0, 0, -0.5}, {0, 0, 0.5}}), 1);
}

// The front runs along a random direction of the disk's plane; the sheet is in that plane or beside it,
// within the overlap of the frusta.
TEST_P(Visibility, HalfPlaneFronts) {
    Random random(2);
    EXPECT_NEAR(uncovered_fraction(-0.5), 0.80, 0.005);
    for (int round = 0; round < repeats(400); ++round) {
        const double distance = random.uniform(0.3, 1.5);
        const Isometry motion = motion_of(random_turn(random), random_in_box(random, 0.2));
        const PairQuery pair{motion * Vec3(0, 0, -distance / 2), motion * Vec3(0, 0, distance / 2)};
        const double angle = random.uniform(0, 2 * std::numbers::pi);
        const int quads = 1 + static_cast<int>(random.below(12));
        const double beside = round % 2 ? random.uniform(-1e-3, 1e-3) : 0.0;
        for (const double s : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
            const auto point_at = [&](double u, double v) {
                return Vec3(motion *
                            (Eigen::AngleAxisd(angle, Vec3::UnitZ()) * (distance / 2 * Vec3(u, v, beside))));
            };
            for (const int size : {16, 32}) {
                const float v =
                    evaluate(sheet(random, -2.5, s, -2, 2.5, quads, point_at), pair, {.disk_size = size});
                EXPECT_NEAR(v, uncovered_fraction(s), size == 16 ? 0.02 : 0.01)
                    << "s " << s << " size " << size << " quads " << quads << " round " << round;
            }
        }
    }
}

// Exactly representable lattice positions: the sheet is in the disk's plane to the last bit, with its
// vertices on sample rays.
TEST_P(Visibility, LatticeSheetInTheDisksPlane) {
    for (int axis = 0; axis < 3; ++axis) {
        const int i = (axis + 1) % 3, j = (axis + 2) % 3;
        for (const double front : {-0.5, 0.0, 0.5}) {
            Triangles triangles;
            const double h = 1.0 / 16;
            for (int u = -17; u * h < front; u += 2)
                for (int v = -17; v < 17; v += 2) {
                    const auto at = [&](int du, int dv) {
                        Vec3 p;
                        p[axis] = 0.5;
                        p[i] = std::min(front, (u + du) * h);
                        p[j] = (v + dv) * h;
                        return p;
                    };
                    triangles.push_back({{at(0, 0), at(2, 0), at(2, 2)}, false});
                    triangles.push_back({{at(0, 0), at(2, 2), at(0, 2)}, false});
                }
            Vec3 b = Vec3::Zero();
            b[axis] = 1;
            EXPECT_NEAR(evaluate(triangles, {Vec3::Zero(), b}), uncovered_fraction(2 * front), 0.02);
        }
    }
}

TEST_P(Visibility, FullCoverGivesZero) {
    Random random(3);
    const VisibilityOptions strict{.disk_size = 32, .full_occlusion_threshold = 0};
    for (int round = 0; round < repeats(3000); ++round) {
        const Isometry motion = motion_of(random_turn(random), random_in_box(random, 0.2));
        const PairQuery pair{motion * Vec3(0, 0, -0.5), motion * Vec3(0, 0, 0.5)};
        // A tilted and bent sheet, wide enough to cover both cones wherever it meets them.
        const double su = random.uniform(-0.4, 0.4), sv = random.uniform(-0.4, 0.4);
        const double offset = random.uniform(-0.3, 0.3) * (random.below(4) > 0),
                     bend = random.uniform(0, 0.05);
        const auto point_at = [&](double u, double v) {
            return Vec3(motion *
                        Vec3(u, v, offset + su * u + sv * v + bend * std::sin(9 * u) * std::cos(7 * v)));
        };
        const auto triangles =
            sheet(random, -1.3, 1.3, -1.3, 1.3, 1 + static_cast<int>(random.below(20)), point_at);
        ASSERT_EQ(evaluate(triangles, pair, strict), 0) << round;
    }
}

// Rays through vertices and along edges: a sheet whose vertices project on samples.
TEST_P(Visibility, NoLightThroughVerticesOnSampleRays) {
    Random random(4);
    for (int round = 0; round < repeats(400); ++round) {
        const Isometry motion =
            round == 0 ? Isometry::Identity() : motion_of(random_turn(random), random_in_box(random, 0.2));
        const PairQuery pair{motion * Vec3(0, 0, -0.5), motion * Vec3(0, 0, 0.5)};
        const Disk disk = make_disk(pair);
        const double depth = random.uniform(0.3, 1);
        const auto point_at = [&](double u, double v) {
            const Vec3 local(depth * u, depth * v, depth);
            return Vec3(disk.apex + disk.radius * disk.radius * disk.axes.transpose() * local);
        };
        Triangles triangles;
        for (int u = -19; u < 19; u += 2)
            for (int v = -19; v < 19; v += 2) {
                const auto at = [&](int du, int dv) { return point_at((u + du) / 16.0, (v + dv) / 16.0); };
                triangles.push_back({{at(0, 0), at(2, 0), at(2, 2)}, false});
                triangles.push_back({{at(0, 2), at(0, 0), at(2, 2)}, false});
            }
        ASSERT_EQ(evaluate(triangles, pair, {.full_occlusion_threshold = 0}), 0) << round;
    }
}

TEST_P(Visibility, SwappingTheTwoChangesNoBit) {
    Random random(5);
    const auto eye = backend();
    for (int round = 0; round < repeats(200); ++round) {
        Triangles triangles = box_boundary(random, {-0.5, -0.5, -0.5}, {0.5, 0.4, 0.3}, 4);
        for (int k = 0; k < 30; ++k) {
            const Vec3 c = random_in_box(random, 0.5);
            triangles.push_back({{c, c + random_in_box(random, 0.2), c + random_in_box(random, 0.2)}, false});
        }
        const auto grid = grid_of(triangles);
        std::vector<PairQuery> pairs, swapped;
        for (int k = 0; k < 20; ++k) {
            pairs.push_back({random_in_box(random, 0.5), random_in_box(random, 0.5)});
            swapped.push_back({pairs.back().b, pairs.back().a});
        }
        std::vector<float> one(20), other(20);
        eye->evaluate(grid, pairs, one, Parallel(1));
        eye->evaluate(grid, swapped, other, Parallel(1));
        ASSERT_EQ(one, other);
    }
}

TEST_P(Visibility, ThreadsChangeNoBit) {
    Random random(6);
    Triangles triangles = box_boundary(random, {-0.8, -0.8, -0.8}, {0.8, 0.8, 0.8}, 8);
    for (int k = 0; k < 200; ++k) {
        const Vec3 c = random_in_box(random, 0.8);
        triangles.push_back({{c, c + random_in_box(random, 0.2), c + random_in_box(random, 0.2)}, false});
    }
    const auto grid = grid_of(triangles);
    std::vector<PairQuery> pairs;
    for (int k = 0; k < (GetParam() == Backend::cpu ? 500 : 130); ++k) {
        const Vec3 a = random_in_box(random, 0.8);
        pairs.push_back({a, a + random_in_box(random, 0.4)});
    }
    std::vector<float> first(pairs.size());
    backend()->evaluate(grid, pairs, first, Parallel(1));
    for (const int threads : {2, 3, 7}) {
        std::vector<float> again(pairs.size());
        backend()->evaluate(grid, pairs, again, Parallel(threads));
        EXPECT_EQ(first, again) << threads;
    }
}

// Near the boundary the disk extends beyond the body; samples outside do not count.
TEST_P(Visibility, SamplesOutsideTheBodyDoNotCount) {
    Random random(7);
    for (int round = 0; round < repeats(300); ++round) {
        const Isometry motion = motion_of(random_turn(random), random_in_box(random, 0.1));
        const double below = random.uniform(0.02, 0.45);  // the pair's depth below the top
        const PairQuery pair{motion * Vec3(-0.5, 0, -below), motion * Vec3(0.5, 0, -below)};
        const auto boundary =
            moved(box_boundary(random, {-1.2, -1, -1.2}, {1.2, 1, 0}, 1 + static_cast<int>(random.below(9))),
                  motion);
        ASSERT_EQ(evaluate(boundary, pair), 1) << round;

        // A cut between the two that ends at the boundary separates them completely.
        const double at = round % 3 ? random.uniform(-0.3, 0.3) : 0.0;
        Triangles severed = boundary;
        for (const auto& t : sheet(random, -1, 1, -1.2, 0, 7,
                                   [&](double u, double v) { return Vec3(motion * Vec3(at, u, v)); }))
            severed.push_back(t);
        ASSERT_EQ(evaluate(severed, pair), 0) << round;
    }
}

TEST_P(Visibility, AxisAlignedBodyOnTheLattice) {
    Random random(8);
    // Pair and boundary at lattice positions, where rays run along faces and through corners.
    for (int k = 1; k < 8; ++k) {
        Triangles boundary;
        for (auto t : box_boundary(random, {-1, -1, -1}, {1, 1, 0}, 1)) boundary.push_back(t);
        const PairQuery pair{{-0.5, 0, -k / 16.0}, {0.5, 0, -k / 16.0}};
        EXPECT_EQ(evaluate(boundary, pair), 1) << k;
        Triangles severed = boundary;
        for (const auto& t : sheet(random, -1, 1, -1, 0, 4, [](double u, double v) { return Vec3(0, u, v); }))
            severed.push_back(t);
        EXPECT_EQ(evaluate(severed, pair), 0) << k;
    }
}

// Two arms of a U: the disk is outside the body, so the segment between the phyxels decides.
TEST_P(Visibility, NothingInsideFallsBackOnTheSegment) {
    Random random(9);
    auto arms = box_boundary(random, {-0.6, -0.2, -0.2}, {-0.3, 0.2, 0.2}, 3);
    for (const auto& t : box_boundary(random, {0.3, -0.2, -0.2}, {0.6, 0.2, 0.2}, 3)) arms.push_back(t);
    EXPECT_EQ(evaluate(arms, {{-0.45, 0, 0}, {0.45, 0, 0}}), 0);
    // A phyxel outside the body: every ray from the first is odd, but nothing is in between.
    const auto far_boundary = box_boundary(random, {0.1, -1, -1}, {1, 1, 1}, 3);
    EXPECT_EQ(evaluate(far_boundary, {{0.2, 0, 0}, {0.6, 0, 0}}), 1);
}

// Material beyond a notch is behind two boundaries: inside, but obscured.
TEST_P(Visibility, NotchObscures) {
    Random random(10);
    auto boundary = box_boundary(random, {-1, -1, -1}, {1, 1, 0.5}, 4);
    // A closed slot across the pair: a hole in the body.
    for (const auto& t : box_boundary(random, {-0.05, -0.9, -0.9}, {0.05, 0.9, 0.45}, 5))
        boundary.push_back(t);
    EXPECT_EQ(evaluate(boundary, {{-0.4, 0, 0}, {0.4, 0, 0}}), 0);
    // The slot beside the disk's plane: all samples are inside and obscured.
    EXPECT_EQ(evaluate(boundary, {{-0.12, 0, -0.1}, {0.6, 0, -0.1}}), 0);
}

TEST_P(Visibility, LowVisibilityCountsAsZero) {
    Random random(11);
    const PairQuery pair{{0, 0, -0.5}, {0, 0, 0.5}};
    const auto nearly = sheet(random, -1, 0.46, -1, 1, 5, [](double u, double v) { return Vec3(u, v, 0); });
    const float exact = evaluate(nearly, pair, {.full_occlusion_threshold = 0});
    EXPECT_GT(exact, 0);
    EXPECT_LT(exact, 0.05);
    EXPECT_EQ(evaluate(nearly, pair), 0);
    EXPECT_EQ(evaluate(nearly, pair, {.full_occlusion_threshold = 0.9 * exact}), exact);
}

// A cut does not hide anything from a phyxel on it: the phyxel's piece decides on which side it is.
TEST_P(Visibility, PhyxelOnTheSurface) {
    Random random(12);
    const auto flat = sheet(random, -1, 1, -1, 1, 6, [](double u, double v) { return Vec3(u, v, -0.5); });
    EXPECT_EQ(evaluate(flat, {{0.05, 0.03, -0.5}, {0.05, 0.03, 0.5}}), 1);
    EXPECT_EQ(evaluate(flat, {{0.05, 0.03, -0.5}, {0.35, 0.2, 0.5}}), 1);
    // The same holds for a sheet that contains both.
    const auto along = sheet(random, -1, 1, -1, 1, 6, [](double u, double v) { return Vec3(u, 0, v); });
    EXPECT_EQ(evaluate(along, {{0, 0, -0.5}, {0, 0, 0.5}}), 1);
}

TEST_P(Visibility, RigidMotionMovesFewSamples) {
    Random random(13);
    double worst_turned = 0, total_turned = 0;
    int count = 0;
    for (int round = 0; round < 80; ++round) {
        const double front = random.uniform(-0.3, 0.3), tilt = random.uniform(-0.5, 0.5);
        const auto scene = sheet(random, -1.2, front, -1.2, 1.2, 6,
                                 [&](double u, double v) { return Vec3(u, v, tilt * u + 0.2 * tilt * v); });
        const PairQuery pair{{0.02, 0.01, -0.4}, {-0.04, 0.03, 0.45}};
        const float before = evaluate(scene, pair);
        const Isometry shift = motion_of(Quat::Identity(), random_in_box(random, 0.5));
        // The raster is translated too: only samples within rounding of an edge can change.
        EXPECT_NEAR(evaluate(moved(scene, shift), {shift * pair.a, shift * pair.b}), before, 1.5 / 208);
        // The raster rotates about the axis: samples along the front change.
        const Isometry turn = motion_of(random_turn(random), random_in_box(random, 0.5));
        const double after = evaluate(moved(scene, turn), {turn * pair.a, turn * pair.b});
        worst_turned = std::max(worst_turned, std::abs(after - before));
        total_turned += std::abs(after - before);
        ++count;
    }
    EXPECT_LE(worst_turned, 12.0 / 208);
    EXPECT_LE(total_turned / count, 4.0 / 208);
}

TEST_P(Visibility, OptionsOutOfRangeAreRefused) {
    for (const int size : {0, 7, 12, 64, -16}) EXPECT_THROW(backend({.disk_size = size}), InputError);
    EXPECT_THROW(backend({.full_occlusion_threshold = -0.1}), InputError);
    EXPECT_THROW(backend({.full_occlusion_threshold = std::nan("")}), InputError);
}

TEST(DiskRaster, SampleCounts) {
    EXPECT_EQ(DiskRaster(8).sample_count, 52);
    EXPECT_EQ(DiskRaster(16).sample_count, 208);
    EXPECT_EQ(DiskRaster(32).sample_count, 812);
}

TEST(DoubleConeBounds, HoldBothConesTightly) {
    Random random(14);
    for (int round = 0; round < repetitions(1000); ++round) {
        const PairQuery pair{random_in_box(random, 1), random_in_box(random, 1)};
        const Disk disk = make_disk(pair);
        const geometry::Box box = double_cone_bounds(pair);
        geometry::Box sampled;
        for (int k = 0; k < 400; ++k) {
            const double angle = random.uniform(0, 2 * std::numbers::pi);
            for (const double depth : {0.0, far_depth}) {
                Vec3 local = depth * Vec3(std::cos(angle), std::sin(angle), 1);
                sampled.add(disk.apex + disk.radius * disk.radius * (disk.axes.transpose() * local));
                local[2] = 2 - local[2];
                sampled.add(disk.apex + disk.radius * disk.radius * (disk.axes.transpose() * local));
            }
        }
        EXPECT_TRUE(box.contains(sampled.min) && box.contains(sampled.max));
        EXPECT_TRUE(sampled.grown(0.01 * disk.radius).contains(box.min));
        EXPECT_TRUE(sampled.grown(0.01 * disk.radius).contains(box.max));
    }
}

}  // namespace
}  // namespace splitcubes::occlusion
