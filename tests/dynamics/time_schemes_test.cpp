// Accuracy and stability of the integrators of implicit steps.
#include "bodies.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

namespace splitcubes::meshless {
namespace {

using fixtures::block;
using fixtures::Specimen;

// A bar of 40 cm that is held at one end and stretched in its first axial mode of `frequency` Hz.
struct AxialWave {
    Specimen body;
    std::vector<std::uint8_t> held;
    std::vector<Vec3> position;
    double first_peak = 0;

    AxialWave(double frequency, TimeScheme scheme, const Parallel& parallel) {
        constexpr double length = 0.4, spacing = 0.02;
        Material material;
        material.poisson_ratio = 0;
        // c = 4 L f. The first layer is held, so the wave starts at its centre.
        material.youngs_modulus = material.density * std::pow(4 * (length - spacing / 2) * frequency, 2);
        body = block(20, 3, 3, spacing, material, parallel);
        body.options.scheme = scheme;
        body.options.tolerance = 1e-6;
        const double start = body.phyxels.rest_position[0].x();
        for (const Vec3& x : body.phyxels.rest_position) held.push_back(x.x() < start + 1e-6);
        position = body.phyxels.rest_position;
        body.input.held = held;
        body.input.held_position = position;
        body.move(
            [&](const Vec3& x) -> Vec3 {
                const double phase = std::numbers::pi / 2 * (x.x() - start) / (length - spacing / 2);
                return x + 0.002 * std::sin(phase) * Vec3::UnitX();
            },
            [](const Vec3&) -> Vec3 { return Vec3::Zero(); });
    }
    double end() const { return body.phyxels.position[19].x() - body.phyxels.rest_position[19].x(); }
    double energy(const SolverReport& report) const { return report.kinetic_energy + report.elastic_energy; }
};

// Returns the share of the amplitude that a wave of 8 Hz keeps per period at 1/60 s.
double kept(TimeScheme scheme) {
    const Parallel parallel(2);
    AxialWave wave(8, scheme, parallel);
    SolverReport report = wave.body.step(parallel);
    const double before = wave.energy(report);
    constexpr int steps = 60;  // 8 periods
    for (int k = 0; k < steps; ++k) report = wave.body.step(parallel);
    return std::pow(wave.energy(report) / before, 0.5 / 8);
}

TEST(TimeSchemes, TrBdf2LosesAtMostAFewPercentOfAnAmplitudePerPeriod) {
    EXPECT_GT(kept(TimeScheme::tr_bdf2), 0.97);
    EXPECT_LT(kept(TimeScheme::tr_bdf2), 1);
    EXPECT_LT(kept(TimeScheme::bdf2), 0.8);
    EXPECT_LT(kept(TimeScheme::backward_euler), 0.4);
}

// From steps of an eightieth of a period, which resolve the waves that the start leaves beside the mode, to
// steps of a fourth of these the error falls by the square of the ratio, less what rounding leaves.
TEST(TimeSchemes, TrBdf2IsOfSecondOrder) {
    const Parallel parallel(2);
    const auto end_after_a_quarter = [&](int steps) {
        AxialWave wave(2, TimeScheme::tr_bdf2, parallel);
        wave.body.input.dt = 0.125 * 0.9 / steps;
        for (int k = 0; k < steps; ++k) wave.body.step(parallel);
        return wave.end();
    };
    const double exact = end_after_a_quarter(320);
    EXPECT_GT(std::abs(end_after_a_quarter(20) - exact), 12 * std::abs(end_after_a_quarter(80) - exact));
}

// TR-BDF2 damps waves that the step cannot resolve, however stiff the material is.
TEST(TimeSchemes, TrBdf2DampsWavesThatAreFasterThanTheStep) {
    const Parallel parallel(2);
    for (const double frequency : {600.0, 6e3, 6e4}) {
        AxialWave wave(frequency, TimeScheme::tr_bdf2, parallel);
        double last = wave.energy(wave.body.step(parallel));
        const double first = last;
        for (int k = 0; k < 40; ++k) {
            const double energy = wave.energy(wave.body.step(parallel));
            EXPECT_LE(energy, 1.001 * last + 1e-6 * first);
            last = energy;
        }
        EXPECT_LT(last, 1e-3 * first) << frequency << " Hz";
    }
}

}  // namespace
}  // namespace splitcubes::meshless
