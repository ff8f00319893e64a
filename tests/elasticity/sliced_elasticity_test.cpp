#include "dynamics/bodies.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <array>

namespace splitcubes::meshless {
namespace {

using fixtures::block;
using fixtures::random_vector;
using fixtures::Specimen;

struct Motion {
    std::vector<Vec3> position, direction;
    std::vector<double> diagonal;
};

Motion shaken(const Specimen& body, const Mat3& turn, double size, Random& random) {
    Motion motion;
    for (const Vec3& rest : body.phyxels.rest_position) {
        motion.position.push_back(turn * rest + random_vector(random, size) + Vec3(3, -2, 1));
        motion.direction.push_back(random_vector(random, 0.01));
        motion.diagonal.push_back(random.uniform(1, 100));
    }
    return motion;
}

struct Found {
    std::vector<Mat3> F, R;
    std::vector<Vec3> force, product;
    double energy = 0, square = 0;
};

Found exact(const Specimen& body, const Motion& motion, const Parallel& parallel) {
    const std::size_t n = motion.position.size();
    Found out{std::vector<Mat3>(n), std::vector<Mat3>(n, Mat3::Identity()), std::vector<Vec3>(n),
              std::vector<Vec3>(n)};
    compute_deformation(body.neighbourhoods, body.phyxels.rest_position, motion.position, out.R, out.F, out.R,
                        parallel);
    ElasticForces elastic;
    const ElasticState state{motion.position, out.F, out.R, body.phyxels.plastic_strain};
    elastic.forces(body.neighbourhoods, body.material, state, out.force, parallel);
    out.energy = elastic.energy(body.neighbourhoods, body.material, state, parallel);
    elastic.linearise(body.neighbourhoods, body.material, state, parallel);
    out.square = elastic.apply_stiffness(body.neighbourhoods, body.material, 1.5, motion.diagonal,
                                         motion.direction, out.product, parallel);
    return out;
}

Found sliced(const Specimen& body, const Motion& motion, const Parallel& parallel) {
    const std::size_t n = motion.position.size();
    Found out{std::vector<Mat3>(n), std::vector<Mat3>(n), std::vector<Vec3>(n), std::vector<Vec3>(n)};
    const std::vector<Mat3> last(n, Mat3::Identity());
    SlicedElasticity elastic;
    const SlicedElasticity::Configuration configuration{body.phyxels.rest_position, motion.position, last,
                                                        body.phyxels.plastic_strain};
    EXPECT_EQ(elastic.take_state(body.neighbourhoods, body.material, configuration, parallel), 0U);
    elastic.read_deformation(out.F, out.R, parallel);
    elastic.take_twists({out.F, out.R, {}, {}}, parallel);
    out.energy = elastic.energy(configuration, parallel);
    elastic.forces(out.force, parallel);
    out.square = elastic.apply_stiffness(1.5, motion.diagonal, motion.direction, out.product, parallel);
    return out;
}

double largest(const std::vector<Vec3>& values) {
    double size = 0;
    for (const Vec3& v : values) size = std::max(size, v.norm());
    return size;
}

// tolerance: of forces, relative to the largest force. Forces and energies count as those of a strain of 4e-5
// at least: some sets of few phyxels have next to none.
void expect_close(const Found& a, const Found& b, double tolerance) {
    const double force = std::max(largest(a.force), 0.01), product = largest(a.product);
    for (std::size_t i = 0; i < a.F.size(); ++i) {
        ASSERT_LT((a.F[i] - b.F[i]).norm(), 1e-5 * (1 + a.F[i].norm())) << i;
        ASSERT_LT((a.R[i] - b.R[i]).norm(), 1e-4) << i;
        ASSERT_LT((a.force[i] - b.force[i]).norm(), tolerance * force) << i;
        ASSERT_LT((a.product[i] - b.product[i]).norm(), 2e-5 * product) << i;
    }
    EXPECT_NEAR(a.energy, b.energy, std::max(1e-4, tolerance) * std::max(a.energy, 1e-8));
    EXPECT_NEAR(a.square, b.square, 1e-5 * a.square);
}

Specimen scattered_specimen(int count, std::uint64_t seed, const Parallel& parallel) {
    Random random(seed);
    Specimen body;
    for (int i = 0; i < count; ++i) body.add(random_vector(random, 0.2), 0.05, i % 2);
    body.connect(parallel);
    return body;
}

// Lattices of all shapes, cut ones and scattered points; gentle motions and ones that
// invert phyxels.
TEST(Sliced, EqualsDoublePrecision) {
    const Parallel parallel(2);
    Random random(1);
    for (int trial = 0; trial < 24; ++trial) {
        Material material;
        if (trial % 4 == 1) material.model = MaterialModel::st_venant_kirchhoff;
        if (trial % 4 == 2) material.volume_stiffness = 1e5;
        if (trial % 8 == 3) material.plasticity = Plasticity{};
        Specimen body = trial % 3 == 2 ? scattered_specimen(200, static_cast<std::uint64_t>(trial), parallel)
                                       : block(3 + trial % 7, 4, 3 + trial % 5, 0.05, material, parallel);
        body.material = material;
        if (trial % 2 == 1) fixtures::cut_randomly(body, 8, 0.1, static_cast<std::uint64_t>(trial), parallel);
        body.neighbourhoods.rebuild(body.phyxels, body.pairs, body.material, parallel);
        const Motion motion =
            shaken(body, fixtures::random_rotation(random), trial % 5 == 4 ? 0.02 : 0.003, random);
        expect_close(exact(body, motion, parallel), sliced(body, motion, parallel), 2e-5);
    }
}

// Strains of 0.01 in rotated bodies: the rounding error relative to them is 1e-5.
TEST(Sliced, FlatAndThinFragmentsEqualDoublePrecision) {
    const Parallel parallel(1);
    Random random(2);
    int deficient = 0, off_plane = 0;
    for (int trial = 0; trial < 120; ++trial) {
        Specimen body;
        if (trial % 4 == 1) body.material.model = MaterialModel::st_venant_kirchhoff;
        const auto thin = [&] { return random.unit() < 0.5 ? 1 : random.uniform(0.005, 0.06); };
        const double y = thin(), z = thin();
        const Vec3 shape(1, y, z);
        const int count = 2 + static_cast<int>(random.below(12));
        for (int i = 0; i < count; ++i) body.add(random_vector(random, 0.1).cwiseProduct(shape), 0.05);
        body.connect(parallel);
        for (std::size_t i = 0; i < body.phyxels.size(); ++i) {
            deficient += body.neighbourhoods.rank()[i] < 3;
            off_plane += body.neighbourhoods.has_neighbours_off_plane(i);
        }
        Motion motion = shaken(body, fixtures::random_rotation(random), 1e-3, random);
        expect_close(exact(body, motion, parallel), sliced(body, motion, parallel), 5e-4);
    }
    EXPECT_GT(deficient, 100);
    EXPECT_GT(off_plane, 30);
}

TEST(Sliced, ForcesAreZeroWithoutStrain) {
    const Parallel parallel(1);
    Specimen body = block(7, 6, 5, 0.05, Material{}, parallel);
    fixtures::cut_randomly(body, 8, 0.1, 7, parallel);
    Random random(3);
    Motion motion = shaken(body, Mat3::Identity(), 0, random);
    for (const Vec3& shift : {Vec3(0, 0, 0), Vec3(1, 2, -4), Vec3(1024, 0, 4096)}) {
        for (std::size_t i = 0; i < motion.position.size(); ++i)
            motion.position[i] = body.phyxels.rest_position[i];
        if (shift.norm() > 0)
            for (Vec3& x : motion.position) x += shift;
        // Positions of moved bodies are themselves rounded.
        const double rounding = shift.norm() * 1e-16 / 0.05;
        const double size = body.material.youngs_modulus * 0.05 * 0.05;
        EXPECT_LE(largest(sliced(body, motion, parallel).force), 100 * rounding * size);
    }
    motion = shaken(body, fixtures::random_rotation(random), 0, random);
    const Found found = sliced(body, motion, parallel);
    EXPECT_LT(largest(found.force), 3e-6 * body.material.youngs_modulus * 0.05 * 0.05) << "turned";
}

// Includes inverted and torn bodies. The energy must be that of the state even after products with the
// stiffness.
TEST(Sliced, EnergyComputedWithTheStateEqualsALaterEvaluation) {
    const Parallel one(1), two(2);
    Random random(5);
    for (const MaterialModel model : {MaterialModel::corotated, MaterialModel::st_venant_kirchhoff}) {
        Material material;
        material.model = model;
        Specimen body = block(11, 9, 8, 0.05, material, one);
        fixtures::cut_randomly(body, 8, 0.15, 9, one);
        const Motion motion = shaken(body, fixtures::random_rotation(random), 0.02, random);
        const std::vector<Mat3> last(body.phyxels.size(), Mat3::Identity());
        const SlicedElasticity::Configuration configuration{body.phyxels.rest_position, motion.position, last,
                                                            body.phyxels.plastic_strain};
        SlicedElasticity together, apart;
        std::vector<double> rows(body.phyxels.size()), wanted(body.phyxels.size());
        EXPECT_EQ(together.take_state_and_energy(body.neighbourhoods, body.material, configuration, two),
                  apart.take_state(body.neighbourhoods, body.material, configuration, one));
        std::vector<Vec3> product(body.phyxels.size());
        const double energy = apart.energy(configuration, one, wanted);
        EXPECT_EQ(together.energy(configuration, two, rows), energy);
        EXPECT_EQ(rows, wanted);
        if (model == MaterialModel::corotated)
            together.apply_stiffness(1, motion.diagonal, motion.direction, product, two);
        EXPECT_EQ(together.energy(configuration, two), energy);
        // A new configuration must not reuse the old energy.
        const Motion moved = shaken(body, Mat3::Identity(), 0.01, random);
        const SlicedElasticity::Configuration next{body.phyxels.rest_position, moved.position, last,
                                                   body.phyxels.plastic_strain};
        together.take_state(body.neighbourhoods, body.material, next, two);
        apart.take_state(body.neighbourhoods, body.material, next, one);
        EXPECT_EQ(together.energy(next, two), apart.energy(next, one));
    }
}

bool same(const Found& a, const Found& b) {
    return a.F == b.F && a.R == b.R && a.force == b.force && a.product == b.product && a.energy == b.energy &&
           a.square == b.square;
}

TEST(Sliced, SameBitsForAnyInstructionSetAndThreadCount) {
    Random random(4);
    Specimen body;
    Motion motion;
    Found of_three;
    {
        const Parallel three(3);
        body = block(11, 9, 8, 0.05, Material{}, three);
        fixtures::cut_randomly(body, 6, 0.15, 7, three);
        motion = shaken(body, fixtures::random_rotation(random), 0.01, random);
        of_three = sliced(body, motion, three);
    }
    const Parallel one(1);
    const Found first = sliced(body, motion, one);
    EXPECT_TRUE(same(first, of_three));
    const Specimen start = body;
    const auto run = [&](SolverKind kind) {
        Specimen copy = start;
        copy.options.kind = kind;
        copy.move([](const Vec3& x) -> Vec3 { return x; },
                  [](const Vec3& x) -> Vec3 { return Vec3(1, 2, 3).cross(x) + 2 * x.cwiseProduct(x); });
        for (int k = 0; k < 3; ++k) copy.step(one);
        return copy.phyxels.position;
    };
    const std::vector<Vec3> implicit_end = run(SolverKind::implicit_steps);
    const std::vector<Vec3> explicit_end = run(SolverKind::explicit_steps);
    const std::int64_t all = hwy::SupportedTargets();
    int tried = 0;
    for (std::int64_t rest = all; rest != 0; rest &= rest - 1) {
        const std::int64_t target = rest & -rest;
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        EXPECT_TRUE(same(first, sliced(body, motion, one))) << hwy::TargetName(target);
        EXPECT_EQ(run(SolverKind::implicit_steps), implicit_end) << hwy::TargetName(target);
        EXPECT_EQ(run(SolverKind::explicit_steps), explicit_end) << hwy::TargetName(target);
        ++tried;
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    EXPECT_GT(tried, 1);
}

TEST(Slices, LatticesUseContiguousRuns) {
    const Parallel parallel(1);
    const Specimen body = block(20, 20, 20, 0.05, Material{}, parallel);
    const LinkSlices& slices = body.neighbourhoods.slices();
    const double links = static_cast<double>(body.neighbourhoods.link_count());
    EXPECT_LT(static_cast<double>(slices.column_count() * LinkSlices::lanes), 1.15 * links);
    EXPECT_LT(10 * slices.gather_count(), slices.column_count());
    // Weights need 12 bytes per link, gradients 28.
    EXPECT_TRUE(slices.weights_pay());
    EXPECT_LT(static_cast<double>(slices.bytes()), 18 * links);
}

}  // namespace
}  // namespace splitcubes::meshless
