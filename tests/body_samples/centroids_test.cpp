// Phyxels near the surface lie at the centroids of their material.
#include "laws/solids.h"
#include "laws/worlds.h"

#include <gtest/gtest.h>
#include <splitcubes/body/body.h>
#include <splitcubes/geometry/shapes.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

namespace splitcubes::body {
namespace {

using namespace laws;

BodySettings coarse(double spacing, bool follows_shape = false) {
    BodySettings settings;
    settings.cell_size = 0.5 * spacing;
    settings.phyxel_spacing = spacing;
    settings.follows_shape = follows_shape;
    return settings;
}

struct Cells {
    std::vector<double> offset;  // per phyxel, from the centroid of its Voronoi cell, m
    double farthest = 0;         // m, of a point of the solid from its phyxel
};

// Measures the cells of a solid in a box around the origin by points that are uniform in it.
Cells cells_by_sampling(const std::vector<Vec3>& phyxels, double half_side,
                        const std::function<bool(const Vec3&)>& contains) {
    Random random(5);
    std::vector<Vec3> sum(phyxels.size(), Vec3::Zero());
    std::vector<double> count(phyxels.size(), 0);
    Cells out;
    for (int k = 0; k < 400000; ++k) {
        const Vec3 point = random_vector(random, half_side);
        if (!contains(point)) continue;
        std::size_t nearest = 0;
        for (std::size_t i = 1; i < phyxels.size(); ++i)
            if ((phyxels[i] - point).squaredNorm() < (phyxels[nearest] - point).squaredNorm()) nearest = i;
        out.farthest = std::max(out.farthest, (phyxels[nearest] - point).norm());
        sum[nearest] += point;
        ++count[nearest];
    }
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        out.offset.push_back((sum[i] / count[i] - phyxels[i]).norm());
    return out;
}

double mean(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

void expect_centroids(const std::vector<Vec3>& phyxels, double spacing, double half_side,
                      const std::function<bool(const Vec3&)>& contains) {
    const Cells cells = cells_by_sampling(phyxels, half_side, contains);
    // Lloyd's rounds converge slowly. Phyxels of a lattice are 0.08 to 0.15 spacings off, on the average.
    EXPECT_LT(mean(cells.offset), 0.075 * spacing);
    EXPECT_LT(*std::max_element(cells.offset.begin(), cells.offset.end()), 0.23 * spacing);
    EXPECT_LT(cells.farthest, 1.2 * spacing);
}

TEST(Centroids, TurnedBoxes) {
    Random random(11);
    for (int trial = 0; trial < 4; ++trial) {
        const Vec3 size(0.1, random.uniform(0.05, 0.1), random.uniform(0.05, 0.1));
        const Quat rotation = random_rotation(random);
        const double spacing = random.uniform(0.016, 0.02);
        const geometry::TriangleMesh box = turned(box_between(Vec3::Zero(), size), rotation);
        const Body body(box, coarse(spacing), Parallel(2));
        expect_centroids(body.phyxels().rest_position, spacing, 0.16, [&](const Vec3& point) {
            const Vec3 along = rotation.conjugate() * point;
            return (along.array() > 0).all() && (along.array() < size.array()).all();
        });
    }
}

TEST(Centroids, Balls) {
    for (const double spacing : {0.017, 0.02, 0.024}) {
        const Body body(geometry::make_sphere(0.05, 4), coarse(spacing), Parallel(2));
        expect_centroids(body.phyxels().rest_position, spacing, 0.05,
                         [](const Vec3& point) { return point.norm() < 0.05; });
    }
}

// A lattice is where its centroids are if the box has whole multiples of the spacing.
TEST(Centroids, ALatticeStays) {
    const double spacing = 0.02;
    const Body body(geometry::make_box(Vec3(0.12, 0.08, 0.06)), coarse(spacing, true), Parallel(2));
    ASSERT_EQ(body.phyxels().size(), 6U * 4 * 3);
    for (const Vec3& at : body.phyxels().rest_position) {
        const Vec3 steps = (at - body.phyxels().rest_position[0]) / spacing;
        EXPECT_LT((steps.array() - steps.array().round()).abs().maxCoeff(), 1e-12);
    }
}

// Layers that do not touch: no phyxel takes material of another layer, and none leaves its own.
TEST(Centroids, LayersBesideEachOther) {
    const double spacing = 0.02;
    geometry::TriangleMesh layers;
    for (int k = 0; k < 3; ++k)
        layers.append(box_between(Vec3(0, 0, 0.017 * k), Vec3(0.2, 0.2, 0.017 * k + 0.012)));
    BodySettings settings = coarse(spacing);
    settings.cell_size = 0.003;
    const Body body(layers, settings, Parallel(2));
    ASSERT_EQ(body.pieces().count(), 3U);
    for (std::size_t i = 0; i < body.phyxels().size(); ++i) {
        const double height = body.phyxels().rest_position[i].z();
        const double layer = std::floor(height / 0.017);
        EXPECT_NEAR(height - 0.017 * layer, 0.006, 0.002);
    }
}

// Rounding moves nothing to one side.
TEST(Centroids, SymmetricBodiesStaySymmetric) {
    Body body(geometry::make_box(Vec3(0.11, 0.09, 0.07)), coarse(0.02, true), Parallel(2));
    const std::vector<Vec3>& rest = body.phyxels().rest_position;
    Vec3 low = rest[0], high = rest[0];
    for (const Vec3& at : rest) {
        low = low.cwiseMin(at);
        high = high.cwiseMax(at);
    }
    for (const Vec3& at : rest)
        for (int axis = 0; axis < 3; ++axis) {
            Vec3 mirrored = at;
            mirrored[axis] = low[axis] + high[axis] - at[axis];
            const bool is_there = std::any_of(rest.begin(), rest.end(), [&](const Vec3& other) {
                return (other - mirrored).norm() < 1e-8 * 0.02;
            });
            EXPECT_TRUE(is_there) << at.transpose() << " axis " << axis;
        }
}

}  // namespace
}  // namespace splitcubes::body
