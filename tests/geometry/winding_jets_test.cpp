// Values and derivatives in single precision agree with the sum in double precision.
#include <splitcubes/geometry/winding_jets.h>

#include "laws/solids.h"

#include <gtest/gtest.h>
#include <splitcubes/geometry/winding_number.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::geometry {
namespace {

using namespace laws;
using Corners = WindingTriangles::Corners;

std::vector<Corners> crowd(std::uint64_t seed, int count, double size) {
    Random random(seed);
    std::vector<Corners> out;
    for (int t = 0; t < count; ++t) {
        const Vec3 center = random_vector(random, 8);
        Corners corners;
        for (Vec3& corner : corners) corner = center + random_vector(random, size);
        out.push_back(corners);
    }
    return out;
}

TriangleMesh mesh_of_crowd(const std::vector<Corners>& triangles) {
    TriangleMesh mesh;
    for (const Corners& corners : triangles) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.insert(mesh.positions.end(), corners.begin(), corners.end());
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

TEST(WindingJets, AreTheExactSumAndItsDerivatives) {
    for (const double size : {0.5, 3.0, 12.0}) {
        const std::vector<Corners> triangles = crowd(1, 2500, size);
        const WindingJets jets(triangles);
        const WindingNumber winding(mesh_of_crowd(triangles));
        Random random(2);
        int smooth = 0;
        for (int trial = 0; trial < 200; ++trial) {
            const Vec3 p = random_vector(random, 10);
            const WindingJet jet = jets.jet(jets.triangles(), p);
            if (!jet.sound) continue;
            const double exact = winding.exact_at(p);
            const double error = 14 * std::sqrt(jet.error2) + 1e-9;
            ASSERT_NEAR(jet.value, exact, error);
            ASSERT_LT(error, 0.02);
            const WindingJet value = jets.value(jets.triangles(), p);
            ASSERT_NEAR(value.value, jet.value, 1e-9);
            for (int axis = 0; axis < 3; ++axis) {
                const double h = 2e-4;
                const double low = winding.exact_at(p - h * Vec3::Unit(axis));
                const double high = winding.exact_at(p + h * Vec3::Unit(axis));
                const double slope = (high - low) / (2 * h), bend = (high - 2 * exact + low) / (h * h);
                // Skips points across a triangle or near a boundary.
                if (std::abs(high - low) > 0.01 || std::abs(bend) > 50) continue;
                ++smooth;
                EXPECT_NEAR(jet.gradient[axis], slope, 1e-3 * (1 + std::abs(slope)));
                EXPECT_NEAR(jet.second[axis], bend, 0.02 * (1 + std::abs(bend)));
            }
        }
        EXPECT_GT(smooth, 300);
    }
}

// On a triangle or its boundary rounding decides.
TEST(WindingJets, AreNotSoundOnTriangles) {
    const std::vector<Corners> triangles = crowd(3, 200, 4);
    const WindingJets jets(triangles);
    for (const Corners& c : triangles)
        for (const Vec3& p : {c[0], Vec3(0.5 * (c[0] + c[1])), Vec3((c[0] + c[1] + c[2]) / 3)}) {
            EXPECT_FALSE(jets.jet(jets.triangles(), p).sound);
            EXPECT_FALSE(jets.value(jets.triangles(), p).sound);
        }
}

double rim_integral(const Corners& corners, const Vec3& from) {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 &a = corners[k], &b = corners[(k + 1) % 3];
        constexpr int steps = 100;
        for (int s = 0; s < steps; ++s) {
            const double r = (a + (s + 0.5) / steps * (b - a) - from).norm();
            sum += (b - a).norm() / steps / std::pow(r, 7);
        }
    }
    return sum;
}

TEST(WindingJets, OmittedTrianglesAreFarAndBounded) {
    Random random(4);
    const std::vector<Corners> triangles = crowd(5, 1000, 6);
    const WindingJets jets(triangles);
    for (int trial = 0; trial < 10; ++trial) {
        const Vec3 center = random_vector(random, 8);
        const double radius = random.uniform(0.2, 2), gap = random.uniform(0.5, 3);
        WindingTriangles kept;
        const double bound = jets.triangles().near(center, radius, gap, kept);
        std::vector<bool> is_kept(triangles.size(), false);
        for (std::size_t k = 0; k < kept.size(); ++k) is_kept[kept.id(k)] = true;
        double largest = 0;
        for (int point = 0; point < 6; ++point) {
            const Vec3 from = center + radius * random_direction(random);
            double exact = 0;
            for (std::size_t t = 0; t < triangles.size(); ++t)
                if (!is_kept[t]) exact += rim_integral(triangles[t], from);
            EXPECT_GE(bound, exact);
            largest = std::max(largest, exact);
        }
        EXPECT_LT(bound, 1000 * largest);
        EXPECT_LT(kept.size(), triangles.size());
        EXPECT_GT(kept.size(), 0U);
    }
}

}  // namespace
}  // namespace splitcubes::geometry
