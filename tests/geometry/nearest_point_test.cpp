#include <gtest/gtest.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/nearest_point.h>
#include <splitcubes/geometry/shapes.h>

#include <cmath>

using namespace splitcubes;
using namespace splitcubes::geometry;

namespace {

Vec3 random_point(Random& random, double largest) {
    const double x = random.uniform(-largest, largest), y = random.uniform(-largest, largest);
    return {x, y, random.uniform(-largest, largest)};
}

/// Triangles of all sizes, some degenerate to a line or a point.
TriangleMesh unit_soup(std::uint64_t seed, std::size_t count) {
    Random random(seed);
    TriangleMesh mesh;
    for (std::uint32_t t = 0; t < count; ++t) {
        const Vec3 a = random_point(random, 1);
        const double size = std::pow(10.0, random.uniform(-4, 0));
        const Vec3 ab = size * random_point(random, 1), ac = size * random_point(random, 1);
        mesh.positions.push_back(a);
        mesh.positions.push_back(a + (t % 11 == 3 ? Vec3(0, 0, 0) : ab));
        mesh.positions.push_back(a + (t % 11 == 3 ? Vec3(0, 0, 0) : t % 11 == 5 ? Vec3(0.3 * ab) : ac));
        mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    return mesh;
}

std::array<Vec3, 3> corners(const TriangleMesh& mesh, std::size_t t) {
    const Triangle& tri = mesh.triangles[t];
    return {mesh.positions[tri[0]], mesh.positions[tri[1]], mesh.positions[tri[2]]};
}

Vec3 mix(const std::array<Vec3, 3>& c, const std::array<double, 3>& w) {
    return w[0] * c[0] + w[1] * c[1] + w[2] * c[2];
}

Vec3 normal_of(const TriangleMesh& mesh, std::size_t t) {
    const auto c = corners(mesh, t);
    return (c[1] - c[0]).cross(c[2] - c[0]);
}

/// Brute-force answer to a query.
double min_value(const TriangleMesh& mesh, const NearestPoint::Query& q) {
    double min = std::numeric_limits<double>::infinity();
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!q.labels.empty() && q.labels[t] != q.label) continue;
        const auto c = corners(mesh, t);
        const double distance = (mix(c, nearest_weights(q.point, c[0], c[1], c[2])) - q.point).norm();
        min = std::min(min, distance + (normal_of(mesh, t).dot(q.normal) < 0 ? q.back_side_penalty : 0));
    }
    return min;
}

}  // namespace

TEST(NearestPoint, WeightsGiveTheNearestPointOfTheTriangle) {
    Random random(1);
    const TriangleMesh mesh = unit_soup(2, 300);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto c = corners(mesh, t);
        const Vec3 p = c[0] + 2 * (c[1] - c[0]).norm() * random_point(random, 1);
        const auto w = nearest_weights(p, c[0], c[1], c[2]);
        EXPECT_NEAR(w[0] + w[1] + w[2], 1, 1e-12);
        const double distance = (mix(c, w) - p).norm();
        for (const double x : w) EXPECT_TRUE(x >= 0 && x <= 1) << x;
        for (int i = 0; i < 200; ++i) {
            double u = random.uniform(0, 1), v = random.uniform(0, 1);
            if (u + v > 1) {
                u = 1 - u;
                v = 1 - v;
            }
            // Includes corners and sides.
            if (i % 4 == 0) u = 0;
            if (i % 8 == 0) v = i % 16 == 0 ? 0 : 1;
            EXPECT_GE((mix(c, {1 - u - v, u, v}) - p).norm(), distance * (1 - 1e-9)) << t;
        }
    }
}

TEST(NearestPoint, IsTheNearestOfAllTriangles) {
    Random random(3);
    for (const std::size_t count : {1U, 4U, 5U, 400U}) {
        const TriangleMesh mesh = unit_soup(4 + count, count);
        const NearestPoint nearest(mesh);
        std::vector<std::int32_t> labels;
        for (std::size_t t = 0; t < count; ++t) labels.push_back(static_cast<std::int32_t>(random.below(3)));
        for (int i = 0; i < 300; ++i) {
            NearestPoint::Query q;
            q.point = random_point(random, i % 7 == 0 ? 100 : 1.2);
            if (i % 3 == 1) {
                q.normal = random_point(random, 1);
                q.back_side_penalty = random.uniform(0, 0.5);
            }
            if (i % 2 == 1) {
                q.labels = labels;
                q.label = labels[random.below(static_cast<std::uint32_t>(count))];
            }
            const NearestPoint::Hit hit = nearest.at(q);
            ASSERT_LT(hit.triangle, count);
            if (!q.labels.empty()) {
                EXPECT_EQ(labels[hit.triangle], q.label);
            }
            const double against = normal_of(mesh, hit.triangle).dot(q.normal) < 0 ? q.back_side_penalty : 0;
            EXPECT_NEAR(hit.distance + against, min_value(mesh, q), 1e-12 * (1 + q.point.norm()));
            EXPECT_NEAR((mix(corners(mesh, hit.triangle), hit.weights) - q.point).norm(), hit.distance,
                        1e-12 * (1 + q.point.norm()));
            // A guess never changes the result.
            q.guess = random.below(static_cast<std::uint32_t>(count));
            const NearestPoint::Hit again = nearest.at(q);
            EXPECT_EQ(again.triangle, hit.triangle);
            EXPECT_EQ(again.weights, hit.weights);
        }
    }
}

TEST(NearestPoint, TiesGoToTheFirst) {
    TriangleMesh mesh;
    const TriangleMesh ball = make_sphere(1, 2);
    for (int copy = 0; copy < 5; ++copy) mesh.append(ball);
    const NearestPoint nearest(mesh);
    Random random(5);
    for (int i = 0; i < 200; ++i) {
        // Straight out from a vertex all its triangles are equally near.
        const std::uint32_t v = random.below(static_cast<std::uint32_t>(ball.positions.size()));
        const NearestPoint::Hit hit = nearest.at({.point = ball.positions[v]});
        std::uint32_t first = 0;
        while (std::find(mesh.triangles[first].begin(), mesh.triangles[first].end(), v) ==
               mesh.triangles[first].end())
            ++first;
        EXPECT_EQ(hit.triangle, first);
        EXPECT_EQ(hit.distance, 0);
    }
}

TEST(NearestPoint, WithoutAnAllowedTriangleThereIsNone) {
    EXPECT_EQ(NearestPoint(TriangleMesh{}).at({.point = Vec3::Zero()}).triangle, NearestPoint::none);
    const TriangleMesh ball = make_sphere(1, 1);
    const std::vector<std::int32_t> labels(ball.triangles.size(), 1);
    EXPECT_EQ(NearestPoint(ball).at({.point = Vec3::Zero(), .labels = labels, .label = 2}).triangle,
              NearestPoint::none);
}
