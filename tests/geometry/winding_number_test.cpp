#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/parallel.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/geometry/winding_number.h>

#include <cmath>
#include <limits>

using namespace splitcubes;
using namespace splitcubes::geometry;

namespace {

Vec3 point_near(Random& random, double size) {
    return size * Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
}

TriangleMesh scaled_and_shifted(TriangleMesh mesh, double scale, const Vec3& shift) {
    for (Vec3& p : mesh.positions) p = scale * p + shift;
    return mesh;
}

// Returns a sphere of radius 1 without its lower half; the rim lies in the plane z = 0.
TriangleMesh hemisphere(int segments) {
    TriangleMesh mesh;
    const auto n = static_cast<std::uint32_t>(segments);
    for (std::uint32_t ring = 0; ring <= n; ++ring)
        for (std::uint32_t s = 0; s < 4 * n; ++s) {
            const double polar = M_PI / 2 * ring / n, angle = M_PI / 2 * s / n;
            mesh.positions.emplace_back(std::cos(polar) * std::cos(angle), std::cos(polar) * std::sin(angle),
                                        std::sin(polar));
        }
    for (std::uint32_t ring = 0; ring < n; ++ring)
        for (std::uint32_t s = 0; s < 4 * n; ++s) {
            const std::uint32_t next = (s + 1) % (4 * n), low = ring * 4 * n, high = low + 4 * n;
            mesh.triangles.push_back({low + s, low + next, high + next});
            mesh.triangles.push_back({low + s, high + next, high + s});  // no area at the pole
        }
    return mesh;
}

}  // namespace

TEST(WindingNumber, IsAnIntegerForClosedMeshes) {
    Random random(1);
    const TriangleMesh torus = make_torus(1, 0.4, 36, 18);
    const WindingNumber winding(torus);
    for (int trial = 0; trial < 200; ++trial) {
        const Vec3 p = point_near(random, 1.6);
        const double tube = std::hypot(std::hypot(p.x(), p.y()) - 1, p.z());
        if (std::abs(tube - 0.4) < 0.02) continue;  // facets and surface differ
        const double expected = tube < 0.4 ? 1 : 0;
        EXPECT_NEAR(winding.exact_at(p), expected, 1e-12);
        EXPECT_NEAR(winding.at(p), expected, 1e-3);
    }
}

TEST(WindingNumber, CountsOverlapsAndSigns) {
    TriangleMesh mesh = make_sphere(1, 3);
    mesh.append(make_box({1, 1, 1}));
    TriangleMesh reversed = make_sphere(0.3, 2);
    for (Triangle& t : reversed.triangles) std::swap(t[1], t[2]);
    mesh.append(reversed);
    const WindingNumber winding(mesh);
    EXPECT_NEAR(winding.at({0, 0, 0.05}), 1, 1e-3);
    EXPECT_NEAR(winding.at({0.4, 0.1, 0}), 2, 1e-3);
    EXPECT_NEAR(winding.at({0.8, 0.1, 0}), 1, 1e-3);
    EXPECT_NEAR(winding.at({1.5, 0.1, 0}), 0, 1e-3);
}

TEST(WindingNumber, IsLinearInTheMesh) {
    Random random(2);
    TriangleMesh a = make_wavy_sheet({0, 0, 0}, {1, 2, 3}, 1, 20, 0.2, 0.7);
    const TriangleMesh b = hemisphere(8);
    TriangleMesh both = a;
    both.append(b);
    TriangleMesh twice = a;
    twice.append(a);
    const WindingNumber wa(a), wb(b), sum(both), doubled(twice);
    for (int trial = 0; trial < 100; ++trial) {
        const Vec3 p = point_near(random, 2);
        EXPECT_NEAR(sum.exact_at(p), wa.exact_at(p) + wb.exact_at(p), 1e-12);
        EXPECT_NEAR(sum.at(p), wa.at(p) + wb.at(p), 1e-3);
        EXPECT_NEAR(doubled.at(p), 2 * wa.at(p), 2e-3);
    }
}

TEST(WindingNumber, FastEvaluationIsCloseToTheSum) {
    Random random(3);
    double worst = 0, square = 0;
    int count = 0;
    for (const TriangleMesh& mesh :
         {make_wavy_sheet({0, 0, 0}, {0, 0, 1}, 1, 30, 0.3, 1.1), hemisphere(12), make_pear(2, 32)}) {
        const WindingNumber winding(mesh);
        for (int trial = 0; trial < 200; ++trial) {
            const Vec3 p = point_near(random, trial % 4 == 0 ? 20 : 1.5);
            const double error = std::abs(winding.at(p) - winding.exact_at(p));
            worst = std::max(worst, error);
            square += error * error;
            ++count;
        }
    }
    RecordProperty("worst", std::to_string(worst));
    EXPECT_LT(worst, 1e-3);
    EXPECT_LT(std::sqrt(square / count), 3e-4);
}

// At four times the distance the error of a second-order expansion, whose first missing term falls with the
// fifth power, must shrink by 4^5 or more: wrong moments would reduce the order.
TEST(WindingNumber, TheExpansionIsOfSecondOrder) {
    // Few enough triangles that a single node answers beyond the root's opening distance.
    const TriangleMesh sheet = make_wavy_sheet({0.3, 0.2, 0.1}, {1, -2, 0.5}, 1, 12, 0.4, 1.3);
    const WindingNumber winding(sheet);
    Random random(4);
    double near = 0, far = 0;
    for (int trial = 0; trial < 200; ++trial) {
        const Vec3 direction = point_near(random, 1).normalized();
        near = std::max(near, std::abs(winding.at(6 * direction) - winding.exact_at(6 * direction)));
        far = std::max(far, std::abs(winding.at(24 * direction) - winding.exact_at(24 * direction)));
    }
    EXPECT_GT(near, 1e-9);
    const double order = std::log(near / far) / std::log(4.0);
    EXPECT_GT(order, 4.6);
    EXPECT_LT(order, 7);
}

TEST(WindingNumber, OfAnOpenHemisphereIsItsSolidAngle) {
    const WindingNumber winding(hemisphere(40));
    // Seen from a point at height z on the axis, the rim's disk covers 2 pi (1 - z / sqrt(1 + z^2)); the
    // hemisphere covers the rest of the sphere for a point inside it.
    for (const double z : {0.0, 0.25, 0.5, 0.9}) {
        const double disk = 0.5 * (1 - z / std::hypot(1, z));
        EXPECT_NEAR(winding.exact_at({0, 0, z}), 1 - disk, 5e-4) << z;
        EXPECT_NEAR(winding.at({0, 0, z}), 1 - disk, 1e-3) << z;
    }
    for (const double z : {1.1, 3.0, -0.5, -4.0}) {
        const double disk = 0.5 * (1 - std::abs(z) / std::hypot(1, z));
        EXPECT_NEAR(winding.exact_at({0, 0, z}), z > 0 ? -disk : disk, 5e-4) << z;
        EXPECT_NEAR(winding.at({0, 0, z}), z > 0 ? -disk : disk, 1e-3) << z;
    }
}

TEST(WindingNumber, IsInvariantUnderScaleAndTranslation) {
    Random random(5);
    const TriangleMesh mesh = make_pear(1, 20);
    const WindingNumber winding(mesh);
    for (const auto& [scale, offset, tolerance] :
         {std::tuple{1e-6, 0.0, 1e-9}, {1e7, 0.0, 1e-9}, {1.0, 1e5, 1e-6}, {1e-3, 1.0, 1e-6}}) {
        const Vec3 shift = offset * Vec3(1, -0.7, 0.3);
        const WindingNumber other(scaled_and_shifted(mesh, scale, shift));
        for (int trial = 0; trial < 100; ++trial) {
            const Vec3 p = point_near(random, 0.8), q = scale * p + shift;
            const double exact = winding.exact_at(p);
            // Within rounding of the surface the side is undetermined.
            if (std::abs(exact - winding.exact_at(p + Vec3::Constant(1e-6))) > 1e-6) continue;
            EXPECT_NEAR(exact, other.exact_at(q), tolerance);
            EXPECT_NEAR(exact, other.at(q), 1e-3);
        }
    }
}

TEST(WindingNumber, DegenerateTrianglesAddNothing) {
    TriangleMesh mesh = make_box({1, 1, 1});
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.triangles.push_back({0, 0, 1});
    mesh.triangles.push_back({2, 2, 2});
    mesh.positions.emplace_back(0.5, 0, 0);
    mesh.positions.emplace_back(0.75, 0, 0);
    mesh.positions.emplace_back(1, 0, 0);
    mesh.triangles.push_back({n, n + 1, n + 2});
    const WindingNumber winding(mesh);
    Random random(6);
    for (int trial = 0; trial < 1000; ++trial) {
        const Vec3 p = point_near(random, 0.8);
        const double expected = p.cwiseAbs().maxCoeff() < 0.5 ? 1 : 0;
        EXPECT_NEAR(winding.at(p), expected, 1e-3);
    }
    // In line with the triangle that has collapsed to a line.
    EXPECT_NEAR(winding.at({0.8, 0, 0}), 0, 1e-3);
}

TEST(WindingNumber, OnTheSurfaceIsTheMeanOfTheSides) {
    const WindingNumber winding(make_box({2, 2, 2}));
    EXPECT_NEAR(winding.exact_at({0.3, 0.2, 1}), 0.5, 1e-12);
    EXPECT_NEAR(winding.exact_at({0.3, 1, 1}), 0.25, 1e-12);
    EXPECT_NEAR(winding.exact_at({1, 1, 1}), 0.125, 1e-12);
    EXPECT_NEAR(winding.at({0.3, 0.2, 1}), 0.5, 1e-3);
}

TEST(WindingNumber, ManyCoincidentTriangles) {
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles.assign(20000, {0, 1, 2});
    const WindingNumber many(mesh);
    mesh.triangles.resize(1);
    const WindingNumber one(mesh);
    for (const Vec3& p : {Vec3(0.2, 0.2, 0.5), Vec3(3, 2, -5)})
        EXPECT_NEAR(many.at(p) / 20000, one.exact_at(p), 1e-4);
}

TEST(WindingNumber, EmptyAndPointMeshesWindNowhere) {
    EXPECT_EQ(WindingNumber(TriangleMesh{}).at({1, 2, 3}), 0);
    const TriangleMesh point{{{1, 1, 1}}, {{0, 0, 0}}};
    EXPECT_EQ(WindingNumber(point).at({1, 1, 1}), 0);
    EXPECT_EQ(WindingNumber(point).exact_at({0, 0, 0}), 0);
}

TEST(WindingNumber, RefusesInvalidMeshes) {
    EXPECT_THROW(WindingNumber({{{0, 0, 0}}, {{0, 0, 1}}}), InputError);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(WindingNumber({{{0, 0, 0}, {1, 0, 0}, {0, nan, 0}}, {{0, 1, 2}}}), InputError);
}

TEST(WindingNumber, IsTheSameOnAnyNumberOfThreads) {
    const WindingNumber winding(make_torus(1, 0.3, 40, 20));
    const auto values = [&](int threads) {
        std::vector<double> out(500);
        Parallel(threads).for_each(out.size(), 8, [&](std::size_t i) {
            Random random(i);
            out[i] = winding.at(point_near(random, 1.4));
        });
        return out;
    };
    EXPECT_EQ(values(1), values(4));
}

namespace {

// Returns unconnected triangles.
TriangleMesh soup(std::uint64_t seed, std::uint32_t count, double size) {
    Random random(seed);
    TriangleMesh mesh;
    for (std::uint32_t t = 0; t < count; ++t) {
        const Vec3 center = point_near(random, 1);
        for (int k = 0; k < 3; ++k) mesh.positions.push_back(center + point_near(random, size));
        mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    return mesh;
}

}  // namespace

TEST(WindingNumber, QuickEvaluationStaysWithinItsTolerance) {
    for (const double size : {0.02, 0.3, 1.5}) {
        const TriangleMesh mesh = soup(7, 3000, size);
        const WindingNumber winding(mesh);
        Random random(8);
        for (int trial = 0; trial < 300; ++trial) {
            const Vec3 p = point_near(random, 1.5);
            const WindingNumber::Estimate quick = winding.quick_at(p);
            EXPECT_NEAR(quick.value, winding.at(p), quick.tolerance);
            EXPECT_LT(quick.tolerance, 1e-5);
            EXPECT_TRUE(size < 1.5 || quick.near_count > 1000);
        }
    }
}

// Rounding decides the side there: both must decide alike.
TEST(WindingNumber, QuickEvaluationAgreesOnTrianglesAndTheirRims) {
    const TriangleMesh mesh = soup(9, 200, 0.8);
    const WindingNumber winding(mesh);
    Random random(10);
    for (const Triangle& t : mesh.triangles) {
        const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
        const double u = random.uniform(0, 0.5), v = random.uniform(0, 0.5);
        for (const Vec3& p :
             {a, Vec3(0.5 * (a + b)), Vec3(a + u * (b - a)), Vec3(a + u * (b - a) + v * (c - a))})
            for (const double limit : {0.5, std::abs(winding.at(p))}) {
                EXPECT_EQ(winding.exceeds(p, limit), std::abs(winding.at(p)) > limit);
                EXPECT_NEAR(winding.quick_at(p).value, winding.at(p), winding.quick_at(p).tolerance);
            }
    }
}
