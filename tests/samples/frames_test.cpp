#include "dynamics/bodies.h"

#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/samples/frames.h>
#include <splitcubes/samples/kernel.h>
#include <splitcubes/samples/sampling.h>

namespace splitcubes::meshless {
namespace {

using fixtures::block;
using fixtures::random_vector;
using fixtures::Specimen;

std::vector<Vec3> some_points(int count, double size, std::uint64_t seed) {
    Random random(seed);
    std::vector<Vec3> points;
    for (int k = 0; k < count; ++k) points.push_back(random_vector(random, size));
    return points;
}

TEST(Kernel, IntegratesToOneAndEndsSmoothly) {
    const double h = 0.7;
    double integral = 0;
    const int steps = 20000;
    for (int k = 0; k < steps; ++k) {
        const double r = (k + 0.5) * h / steps;
        integral += kernel(r * r, h) * 4 * std::numbers::pi * r * r * h / steps;
    }
    EXPECT_NEAR(integral, 1, 1e-6);
    EXPECT_EQ(kernel(h * h, h), 0);
    EXPECT_GT(kernel(0, h), kernel(0.1, h));
}

TEST(Frames, AreExactForAffineMotionsAndAtRest) {
    const Parallel parallel(2);
    Specimen body = block(7, 6, 5, 0.05, Material{}, parallel);
    const PhyxelLocator locator(body.phyxels.rest_position, 0.08);
    const std::vector<Vec3> points = some_points(300, 0.13, 1);
    const std::vector<std::int32_t> piece(points.size(), 0);
    const NodeKernels kernels = build_kernels(points, piece, body.phyxels, locator, {}, parallel);
    std::vector<geometry::Frame> frames(points.size());
    evaluate_frames(kernels, points, body.phyxels, frames, parallel);
    for (std::size_t p = 0; p < points.size(); ++p) {
        ASSERT_GT(kernels.rows[p].count, 0U);
        EXPECT_EQ(frames[p].position, points[p]);
        EXPECT_EQ(frames[p].jacobian, Mat3::Identity());
    }
    Random random(2);
    const Mat3 A = 1.3 * fixtures::random_rotation(random) + 0.2 * Mat3::Identity();
    const Vec3 shift(1, 2, 3);
    body.move([&](const Vec3& x) -> Vec3 { return A * x + shift; },
              [](const Vec3&) { return Vec3(0, 0, 0); });
    update_deformation(body.phyxels, body.neighbourhoods, parallel);
    evaluate_frames(kernels, points, body.phyxels, frames, parallel);
    for (std::size_t p = 0; p < points.size(); ++p) {
        EXPECT_LT((frames[p].position - (A * points[p] + shift)).norm(), 1e-12);
        EXPECT_LT((frames[p].jacobian - A).norm(), 1e-12);
    }
}

TEST(Frames, MatchTheFormula) {
    const Parallel parallel(1);
    Specimen body = block(5, 5, 5, 0.05, Material{}, parallel);
    Random random(3);
    for (std::size_t i = 0; i < body.phyxels.size(); ++i) {
        body.phyxels.piece[i] = static_cast<std::int32_t>(i % 2);
        body.phyxels.position[i] += random_vector(random, 0.02);
        body.phyxels.deformation[i] += 0.1 * fixtures::random_rotation(random);
    }
    const auto visible = [](std::size_t point, std::uint32_t phyxel) {
        return (point + phyxel) % 3 == 0 ? 0.0 : 0.5;
    };
    const std::vector<Vec3> points = some_points(200, 0.2, 4);
    std::vector<std::int32_t> piece(points.size());
    for (std::size_t p = 0; p < points.size(); ++p) piece[p] = static_cast<std::int32_t>(p % 3);
    const PhyxelLocator locator(body.phyxels.rest_position, 0.08);
    const NodeKernels kernels = build_kernels(points, piece, body.phyxels, locator, visible, parallel);
    geometry::Frame untouched{Vec3(7, 7, 7), Mat3::Zero()};
    std::vector<geometry::Frame> frames(points.size(), untouched);
    evaluate_frames(kernels, points, body.phyxels, frames, parallel);
    std::size_t empty = 0;
    for (std::size_t p = 0; p < points.size(); ++p) {
        double total = 0;
        Vec3 position = Vec3::Zero();
        Mat3 jacobian = Mat3::Zero();
        for (std::uint32_t i = 0; i < body.phyxels.size(); ++i) {
            if (body.phyxels.piece[i] != piece[p]) continue;
            const Vec3 arm = points[p] - body.phyxels.rest_position[i];
            const double w = kernel(arm.squaredNorm(), body.phyxels.support_radius[i]) * visible(p, i);
            total += w;
            position += w * (body.phyxels.position[i] + body.phyxels.deformation[i] * arm);
            jacobian += w * body.phyxels.deformation[i];
        }
        if (total == 0) {
            ++empty;
            EXPECT_EQ(kernels.rows[p].count, 0U);
            EXPECT_EQ(frames[p].position, untouched.position);
            continue;
        }
        EXPECT_LT((frames[p].position - position / total).norm(), 1e-12);
        EXPECT_LT((frames[p].jacobian - jacobian / total).norm(), 1e-12);
    }
    EXPECT_GT(empty, 10U);
    EXPECT_LT(empty, points.size() / 2 + 40);
}

TEST(Frames, PartialRebuildEqualsFullOne) {
    const Parallel parallel(2);
    Specimen body = block(6, 6, 6, 0.05, Material{}, parallel);
    const PhyxelLocator locator(body.phyxels.rest_position, 0.08);
    const std::vector<Vec3> points = some_points(400, 0.17, 5);
    const std::vector<std::int32_t> piece(points.size(), 0);
    const Visible all;
    const Visible few = [](std::size_t, std::uint32_t phyxel) { return phyxel % 4 == 0 ? 1.0 : 0.0; };
    NodeKernels kernels = build_kernels(points, piece, body.phyxels, locator, few, parallel);
    Random random(6);
    for (int round = 0; round < 8; ++round) {
        std::vector<std::uint32_t> subset;
        for (std::uint32_t p = 0; p < points.size(); ++p)
            if (random.unit() < 0.5) subset.push_back(p);
        rebuild_kernels(kernels, subset, points, piece, body.phyxels, locator, round % 2 == 0 ? all : few,
                        parallel);
        rebuild_kernels(kernels, subset, points, piece, body.phyxels, locator, few, parallel);
    }
    const NodeKernels fresh = build_kernels(points, piece, body.phyxels, locator, few, parallel);
    for (std::size_t p = 0; p < points.size(); ++p) {
        const NodeKernels::Row a = kernels.rows[p], b = fresh.rows[p];
        ASSERT_EQ(a.count, b.count);
        for (std::uint32_t k = 0; k < a.count; ++k) {
            EXPECT_EQ(kernels.phyxel[a.begin + k], fresh.phyxel[b.begin + k]);
            EXPECT_EQ(kernels.weight[a.begin + k], fresh.weight[b.begin + k]);
        }
    }
    EXPECT_LE(2 * kernels.unused, kernels.phyxel.size()) << "the pool is kept tidy";
}

TEST(Sampling, LatticeCoversTheBoxEvenly) {
    const geometry::Box box{Vec3(-0.25, -0.25, 0), Vec3(0.25, 0.25, 0.4)};
    const auto everywhere = [](const Vec3& point) { return std::optional<Vec3>(point); };
    const std::vector<Vec3> samples = sample_solid(box, 0.05, everywhere, {}, 0.1);
    ASSERT_EQ(samples.size(), 800U);
    Vec3 sum = Vec3::Zero();
    for (const Vec3& sample : samples) {
        EXPECT_TRUE(box.contains(sample));
        sum += sample;
    }
    EXPECT_LT((sum / 800 - box.center()).norm(), 1e-12);
    EXPECT_EQ(sample_solid(box, 10, everywhere, {}, 1).size(), 1U) << "a small solid has one phyxel at least";
}

TEST(Sampling, KeepsMinimumDistanceAndCoverage) {
    const geometry::Box box{Vec3::Constant(-1), Vec3::Constant(1)};
    const double spacing = 0.2, cover = 0.25;
    // Candidates just outside a ball are pulled onto it: many come close together.
    const auto ball = [](const Vec3& point) -> std::optional<Vec3> {
        const double r = point.norm();
        if (r > 1.2) return std::nullopt;
        return r > 0.8 ? Vec3(point * (0.8 / r)) : point;
    };
    std::vector<Vec3> must = some_points(200, 1, 8);
    const std::vector<Vec3> samples = sample_solid(box, spacing, ball, must, cover);
    for (std::size_t a = 0; a < samples.size(); ++a)
        for (std::size_t b = a + 1; b < samples.size(); ++b)
            EXPECT_GE((samples[a] - samples[b]).norm(), 0.5 * spacing - 1e-12);
    std::size_t added = 0;
    for (const Vec3& point : must) {
        double nearest = 1e9;
        for (const Vec3& sample : samples) nearest = std::min(nearest, (sample - point).norm());
        EXPECT_LT(nearest, cover);
        added += nearest == 0;
    }
    EXPECT_GT(added, 5U);
    EXPECT_EQ(sample_solid(box, spacing, ball, must, cover), samples);
}

TEST(Sampling, RejectsBadInput) {
    const geometry::Box box{Vec3::Zero(), Vec3::Ones()};
    const auto nowhere = [](const Vec3&) { return std::optional<Vec3>(); };
    EXPECT_THROW(sample_solid(geometry::Box{}, 0.1, nowhere, {}, 0.1), InputError);
    EXPECT_THROW(sample_solid(box, 0, nowhere, {}, 0.1), InputError);
    EXPECT_THROW(sample_solid(box, 0.1, nowhere, {}, -1), InputError);
    EXPECT_THROW(sample_solid(box, 1e-6, nowhere, {}, 0.1), InputError);
    EXPECT_TRUE(sample_solid(box, 0.1, nowhere, {}, 0.1).empty());
}

}  // namespace
}  // namespace splitcubes::meshless
