#include "dynamics/bodies.h"

#include <gtest/gtest.h>

#include <array>

namespace splitcubes::meshless {
namespace {

using fixtures::block;
using fixtures::random_vector;
using fixtures::Specimen;

struct State {
    std::vector<Mat3> F, R;
    std::vector<Vec3> force;
    double energy = 0;
};

State state_of(const Specimen& body, const std::vector<Vec3>& position, const Parallel& parallel) {
    const std::size_t n = position.size();
    State state{std::vector<Mat3>(n), std::vector<Mat3>(n, Mat3::Identity()), std::vector<Vec3>(n)};
    compute_deformation(body.neighbourhoods, body.phyxels.rest_position, position, state.R, state.F, state.R,
                        parallel);
    ElasticForces elastic;
    const ElasticState elastic_state{position, state.F, state.R, body.phyxels.plastic_strain};
    elastic.forces(body.neighbourhoods, body.material, elastic_state, state.force, parallel);
    state.energy = elastic.energy(body.neighbourhoods, body.material, elastic_state, parallel);
    return state;
}

void linearise(ElasticForces& elastic, const Specimen& body, const std::vector<Vec3>& position,
               const State& state, const Parallel& parallel) {
    elastic.linearise(body.neighbourhoods, body.material,
                      {position, state.F, state.R, body.phyxels.plastic_strain}, parallel);
}

std::vector<Vec3> shaken_positions(const Specimen& body, double size, Random& random) {
    std::vector<Vec3> position = body.phyxels.rest_position;
    const Mat3 turn = fixtures::random_rotation(random);
    for (Vec3& x : position) x = turn * x + random_vector(random, size);
    return position;
}

void strain_plastically(Specimen& body, double size, Random& random) {
    if (!body.material.plasticity) return;
    for (Mat3& plastic : body.phyxels.plastic_strain) {
        Mat3 strain;
        for (int k = 0; k < 3; ++k) strain.col(k) = random_vector(random, size);
        plastic = 0.5 * (strain + strain.transpose());
    }
}

// The force of a unit strain at one phyxel: the scale for forces that should be zero.
double force_scale(const Specimen& body) {
    double scale = 0;
    for (std::size_t i = 0; i < body.phyxels.size(); ++i)
        scale = std::max(
            scale, body.material.youngs_modulus * std::cbrt(body.phyxels.volume[i] * body.phyxels.volume[i]));
    return scale;
}

void expect_rigid_motion_free(const Specimen& body, const Mat3& turn, const Parallel& parallel) {
    std::vector<Vec3> position = body.phyxels.rest_position;
    for (Vec3& x : position) x = turn * x + Vec3(0.3, -2, 5);
    const State state = state_of(body, position, parallel);
    for (std::size_t i = 0; i < position.size(); ++i) {
        EXPECT_LT((state.F[i].transpose() * state.F[i] - Mat3::Identity()).norm(), 1e-9);
        EXPECT_LT((state.F[i] - state.R[i]).norm(), 1e-9);
        EXPECT_LT(state.force[i].norm(), 1e-9 * force_scale(body));
    }
}

TEST(Elasticity, RigidMotionsCauseNoForce) {
    const Parallel parallel(1);
    Random random(1);
    const Specimen body = block(6, 5, 4, 0.05, Material{}, parallel);
    for (int trial = 0; trial < 10; ++trial)
        expect_rigid_motion_free(body, fixtures::random_rotation(random), parallel);
    for (int axis = 0; axis < 3; ++axis) {
        const Mat3 half_turn = 2 * Vec3::Unit(axis) * Vec3::Unit(axis).transpose() - Mat3::Identity();
        expect_rigid_motion_free(body, half_turn, parallel);
    }
}

// Returns a block under many cuts, or a small random set of phyxels, down to one, some flattened or
// elongated.
Specimen random_fragments(int trial, Random& random, const Material& material, const Parallel& parallel) {
    Specimen body;
    if (trial % 2 == 0) {
        body = block(6, 6, 5, 0.05, material, parallel);
        fixtures::cut_randomly(body, 5 + trial, 0.15, static_cast<std::uint64_t>(trial), parallel);
        return body;
    }
    body.material = material;
    const auto thin = [&] { return random.unit() < 0.5 ? 1 : random.uniform(0.005, 0.06); };
    const double y = thin(), z = thin();
    const Mat3 turn = fixtures::random_rotation(random);
    const int count = 1 + static_cast<int>(random.below(12));
    for (int i = 0; i < count; ++i)
        body.add(turn * random_vector(random, 0.1).cwiseProduct(Vec3(1, y, z)), 0.05);
    body.connect(parallel);
    return body;
}

TEST(Elasticity, RigidMotionsOfFragmentsCauseNoForce) {
    const Parallel parallel(1);
    Random random(2);
    std::array<int, 4> ranks{};
    for (int trial = 0; trial < 60; ++trial) {
        const Specimen body = random_fragments(trial, random, Material{}, parallel);
        for (const auto rank : body.neighbourhoods.rank()) ++ranks[rank];
        expect_rigid_motion_free(body, fixtures::random_rotation(random), parallel);
        expect_rigid_motion_free(body, Vec3(1, -1, -1).asDiagonal(), parallel);
    }
    for (const int count : ranks) EXPECT_GT(count, 20) << "every rank must have been tried";
}

TEST(Elasticity, UniformStretchHasTheAnalyticStress) {
    const Parallel parallel(1);
    Material material;
    material.youngs_modulus = 2e5;
    material.poisson_ratio = 0.3;
    const Specimen body = block(8, 8, 8, 0.05, material, parallel);
    const Vec3 stretch(1.2, 0.9, 1.05);
    Random random(3);
    const Mat3 turn = fixtures::random_rotation(random);
    std::vector<Vec3> position = body.phyxels.rest_position;
    for (Vec3& x : position) x = turn * stretch.cwiseProduct(x);
    const State state = state_of(body, position, parallel);
    const double mu = material.lame_mu(), lambda = material.lame_lambda();
    const Vec3 principal =
        2 * mu * (stretch.array() - 1).matrix() + Vec3::Constant(lambda * (stretch.sum() - 3));
    for (std::size_t i = 0; i < position.size(); ++i) {
        const Mat3 stress = piola_stress(material, state.F[i], state.R[i]);
        EXPECT_LT((stress - turn * principal.asDiagonal()).norm(), 1e-9 * material.youngs_modulus);
        const bool deep = body.phyxels.rest_position[i].cwiseAbs().maxCoeff() < 0.08;
        if (deep) {
            EXPECT_LT(state.force[i].norm(), 1e-9 * force_scale(body)) << "no net force inside";
        }
    }
    const double density =
        mu * (stretch.array() - 1).square().sum() + lambda / 2 * std::pow(stretch.sum() - 3, 2);
    EXPECT_NEAR(state.energy, density * 512 * std::pow(0.05, 3), 1e-9 * density);
}

// Compares the forces on every so many phyxels with differences of the energy.
void expect_force_is_gradient(const Specimen& body, const std::vector<Vec3>& position, std::size_t every,
                              const Parallel& parallel) {
    const State state = state_of(body, position, parallel);
    double scale = 0;
    for (const Vec3& force : state.force) scale = std::max(scale, force.norm());
    const double step = 1e-7;
    for (std::size_t i = 0; i < position.size(); i += every)
        for (int axis = 0; axis < 3; ++axis) {
            std::vector<Vec3> high = position, low = position;
            high[i][axis] += step;
            low[i][axis] -= step;
            const double slope =
                (state_of(body, high, parallel).energy - state_of(body, low, parallel).energy) / (2 * step);
            EXPECT_NEAR(state.force[i][axis], -slope, 1e-5 * scale);
        }
}

TEST(Elasticity, ForceIsTheNegativeEnergyGradient) {
    const Parallel parallel(1);
    Random random(4);
    for (int kind = 0; kind < 8; ++kind) {
        Material material;
        material.zero_energy = kind % 4 == 3 ? 0.0 : 0.1;
        if (kind >= 4) material.model = MaterialModel::st_venant_kirchhoff;
        if (kind % 4 == 1) material.volume_stiffness = 2e5;
        if (kind % 4 == 2) material.plasticity = Plasticity{};
        Specimen body = block(4, 4, 4, 0.05, material, parallel);
        strain_plastically(body, 0.1, random);
        const std::vector<Vec3> position = shaken_positions(body, 0.01, random);
        expect_force_is_gradient(body, position, 7, parallel);
    }
}

// Layers that are nearly flat: F maps what lies off their plane by a normal that follows the phyxels.
TEST(Elasticity, ForcesOfFlatNeighbourhoodsAreTheGradientAndExertNoTorque) {
    const Parallel parallel(1);
    Random random(14);
    int off_plane = 0;
    for (int trial = 0; trial < 30; ++trial) {
        Specimen body;
        if (trial % 3 == 1) body.material.model = MaterialModel::st_venant_kirchhoff;
        if (trial % 3 == 2) body.material.plasticity = Plasticity{};
        const Vec3 shape(1, 1, random.uniform(0.02, 0.06));
        for (int i = 0; i < 9; ++i) body.add(random_vector(random, 0.1).cwiseProduct(shape), 0.05);
        body.connect(parallel);
        strain_plastically(body, 0.05, random);
        for (std::size_t i = 0; i < body.phyxels.size(); ++i)
            off_plane += body.neighbourhoods.has_neighbours_off_plane(i);
        const std::vector<Vec3> position = shaken_positions(body, 0.004, random);
        const State state = state_of(body, position, parallel);
        double scale = 0;
        Vec3 torque = Vec3::Zero();
        for (std::size_t i = 0; i < position.size(); ++i) {
            scale = std::max(scale, state.force[i].norm());
            torque += (position[i] - position[0]).cross(state.force[i]);
        }
        EXPECT_LT(torque.norm(), 1e-11 * scale);
        expect_force_is_gradient(body, position, 4, parallel);
    }
    EXPECT_GT(off_plane, 100);
}

TEST(Elasticity, ForcesConserveMomentum) {
    const Parallel parallel(1);
    Random random(5);
    for (const MaterialModel model : {MaterialModel::corotated, MaterialModel::st_venant_kirchhoff})
        for (const int cuts : {0, 30}) {
            Material material;
            material.model = model;
            material.volume_stiffness = 1e5;
            material.plasticity = Plasticity{};
            Specimen body = block(6, 5, 4, 0.05, material, parallel);
            fixtures::cut_randomly(body, cuts, 0.12, 3, parallel);
            strain_plastically(body, 0.1, random);
            const std::vector<Vec3> position = shaken_positions(body, 0.01, random);
            const State state = state_of(body, position, parallel);
            Vec3 sum = Vec3::Zero(), torque = Vec3::Zero();
            double scale = 0;
            for (std::size_t i = 0; i < position.size(); ++i) {
                sum += state.force[i];
                torque += position[i].cross(state.force[i]);
                scale += state.force[i].norm();
            }
            EXPECT_LT(sum.norm(), 1e-12 * scale);
            EXPECT_LT(torque.norm(), 1e-11 * scale);
        }
}

// Compares the product of the tangent with random displacements of `size` (m) with the difference of the
// forces on both sides; rotations are recomputed there, so that is the true derivative. least: N, of the
// force that the tolerance is relative to.
void expect_derivative(const Specimen& body, const std::vector<Vec3>& position, double size, double tolerance,
                       double least, Random& random, const Parallel& parallel) {
    const State state = state_of(body, position, parallel);
    const std::size_t n = position.size();
    std::vector<Vec3> dx(n), high = position, low = position, out(n);
    for (std::size_t i = 0; i < n; ++i) {
        dx[i] = random_vector(random, size);
        high[i] += dx[i];
        low[i] -= dx[i];
    }
    const std::vector<double> none(n, 0);
    ElasticForces elastic;
    linearise(elastic, body, position, state, parallel);
    const double product =
        elastic.apply_stiffness(body.neighbourhoods, body.material, 1, none, dx, out, parallel);
    const std::vector<Vec3> up = state_of(body, high, parallel).force;
    const std::vector<Vec3> down = state_of(body, low, parallel).force;
    double scale = least, sum = 0;
    for (const Vec3& force : out) scale = std::max(scale, force.norm());
    for (std::size_t i = 0; i < n; ++i) {
        EXPECT_LT((out[i] + 0.5 * (up[i] - down[i])).norm(), tolerance * scale)
            << i << ", rank " << static_cast<int>(body.neighbourhoods.rank()[i]);
        sum += dx[i].dot(out[i]);
    }
    EXPECT_NEAR(product, sum, 1e-12 * sum);
}

TEST(Stiffness, IsTheDerivativeOfTheForcesWithoutStrain) {
    const Parallel parallel(1);
    Random random(6);
    const Specimen body = block(4, 4, 4, 0.05, Material{}, parallel);
    expect_derivative(body, shaken_positions(body, 0, random), 1e-6, 1e-6, 0, random, parallel);
}

Material material_of(int trial) {
    Material out;
    if (trial % 4 == 3) out.model = MaterialModel::st_venant_kirchhoff;
    if (trial % 8 == 5) out.volume_stiffness = 1e5;
    if (trial % 8 == 6) out.plasticity = Plasticity{};
    return out;
}

// Fragments of any rank: completed directions turn with the others.
TEST(Stiffness, OfFragmentsIsTheDerivativeOfTheForcesWithoutStrain) {
    const Parallel parallel(1);
    Random random(18);
    std::array<int, 4> ranks{};
    int off_plane = 0;
    for (int trial = 0; trial < 120; ++trial) {
        SCOPED_TRACE(trial);
        const Specimen body = random_fragments(trial, random, material_of(trial / 2), parallel);
        for (std::size_t i = 0; i < body.phyxels.size(); ++i) {
            ++ranks[body.neighbourhoods.rank()[i]];
            off_plane += body.neighbourhoods.has_neighbours_off_plane(i);
        }
        expect_derivative(body, shaken_positions(body, 0, random), 1e-7, 1e-4, 1e-9 * force_scale(body),
                          random, parallel);
    }
    for (const int count : ranks) EXPECT_GT(count, 20) << "every rank must have been tried";
    EXPECT_GT(off_plane, 20);
}

// The tangent of St. Venant-Kirchhoff is exact where nothing is compressed: here all
// directions are stretched by a quarter and phyxels are perturbed.
TEST(Stiffness, OfStVenantKirchhoffIsTheDerivativeOfTheForcesUnderTension) {
    const Parallel parallel(1);
    Random random(16);
    Material material;
    material.model = MaterialModel::st_venant_kirchhoff;
    const Specimen body = block(4, 4, 4, 0.05, material, parallel);
    std::vector<Vec3> position = shaken_positions(body, 0.001, random);
    for (Vec3& x : position) x *= 1.25;
    expect_derivative(body, position, 1e-6, 1e-6, 0, random, parallel);
}

TEST(Stiffness, IsSymmetricPositiveSemidefinite) {
    const Parallel parallel(1);
    Random random(7);
    for (const int cuts : {0, 6, 40, -6}) {
        Material material;
        if (cuts < 0) {
            material.model = MaterialModel::st_venant_kirchhoff;
            material.volume_stiffness = 1e5;
        }
        Specimen body = block(5, 5, 4, 0.05, material, parallel);
        fixtures::cut_randomly(body, std::abs(cuts), 0.1, 8, parallel);
        const std::vector<Vec3> position = shaken_positions(body, 0.01, random);
        const State state = state_of(body, position, parallel);
        const std::size_t n = state.R.size();
        const std::vector<double> none(n, 0);
        ElasticForces elastic;
        linearise(elastic, body, position, state, parallel);
        for (const double factor : {1.0, 2.5})
            for (int trial = 0; trial < 10; ++trial) {
                std::vector<Vec3> a(n), b(n), Ka(n), Kb(n);
                for (std::size_t i = 0; i < n; ++i) {
                    a[i] = random_vector(random, 1);
                    b[i] = random_vector(random, 1);
                }
                const auto apply = [&](const std::vector<Vec3>& in, std::vector<Vec3>& out) {
                    return elastic.apply_stiffness(body.neighbourhoods, body.material, factor, none, in, out,
                                                   parallel);
                };
                const double aKa = apply(a, Ka), bKb = apply(b, Kb);
                EXPECT_GE(aKa, 0);
                double bKa = 0, aKb = 0;
                for (std::size_t i = 0; i < n; ++i) {
                    bKa += b[i].dot(Ka[i]);
                    aKb += a[i].dot(Kb[i]);
                }
                EXPECT_NEAR(bKa, aKb, 1e-12 * std::sqrt(aKa * bKb));
            }
    }
}

void expect_no_resistance_to_rotation(const Specimen& body, Random& random, const Parallel& parallel) {
    const Mat3 turn = fixtures::random_rotation(random);
    std::vector<Vec3> position = body.phyxels.rest_position, velocity(position.size()), out(position.size());
    const Vec3 omega(1, 2, 3);
    for (std::size_t i = 0; i < position.size(); ++i) {
        position[i] = turn * position[i];
        velocity[i] = omega.cross(position[i]);
    }
    const State state = state_of(body, position, parallel);
    const std::vector<double> none(position.size(), 0);
    ElasticForces elastic;
    linearise(elastic, body, position, state, parallel);
    elastic.apply_stiffness(body.neighbourhoods, body.material, 1, none, velocity, out, parallel);
    for (std::size_t i = 0; i < out.size(); ++i)
        EXPECT_LT(out[i].norm(), 1e-9 * force_scale(body))
            << "rank " << static_cast<int>(body.neighbourhoods.rank()[i]);
}

TEST(Stiffness, DoesNotResistRotation) {
    const Parallel parallel(1);
    Random random(9);
    expect_no_resistance_to_rotation(block(5, 5, 4, 0.05, Material{}, parallel), random, parallel);
    for (int trial = 0; trial < 120; ++trial) {
        SCOPED_TRACE(trial);
        expect_no_resistance_to_rotation(random_fragments(trial, random, material_of(trial / 2), parallel),
                                         random, parallel);
    }
}

TEST(Stiffness, DiagonalIsExact) {
    const Parallel parallel(1);
    const Specimen body = block(5, 5, 5, 0.05, Material{}, parallel);
    const std::size_t n = body.phyxels.size();
    const std::vector<double> none(n, 0);
    const std::vector<Vec3>& position = body.phyxels.rest_position;
    ElasticForces elastic;
    linearise(elastic, body, position, state_of(body, position, parallel), parallel);
    for (const std::size_t i : {std::size_t{0}, std::size_t{62}, std::size_t{57}}) {
        double trace = 0;
        for (int axis = 0; axis < 3; ++axis) {
            std::vector<Vec3> dx(n, Vec3::Zero()), out(n);
            dx[i] = Vec3::Unit(axis);
            trace += elastic.apply_stiffness(body.neighbourhoods, body.material, 1, none, dx, out, parallel);
        }
        const double ratio = body.neighbourhoods.stiffness_diagonal()[i] / (trace / 3);
        EXPECT_NEAR(ratio, 1, 1e-9);
    }
}

}  // namespace
}  // namespace splitcubes::meshless
