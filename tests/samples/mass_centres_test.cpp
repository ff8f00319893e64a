#include "samples/lumping_scene.h"

#include <gtest/gtest.h>
#include <splitcubes/samples/mass_centres.h>

#include <span>
#include <vector>

namespace splitcubes::meshless {
namespace {

using fixtures::random_vector;
using Scene = fixtures::LumpingScene;

// First moment of each piece in rest space, by its nodes less by its phyxels of this mass, kg m.
std::vector<Vec3> lacking_moments(const Scene& scene, std::span<const double> mass, std::size_t pieces) {
    std::vector<Vec3> out(pieces, Vec3::Zero());
    for (std::size_t b = 0; b < scene.nodes.size(); ++b)
        out[static_cast<std::size_t>(scene.pieces[b])] += scene.density * scene.volumes[b] * scene.nodes[b];
    for (std::size_t i = 0; i < scene.phyxels.size(); ++i)
        out[static_cast<std::size_t>(scene.phyxels.piece[i])] -= mass[i] * scene.phyxels.rest_position[i];
    return out;
}

// Random planes part the pieces again and again. However small these get, each has the mass of its nodes and
// none of it is negative. Those of 40 phyxels have its first moment as well; others, whose phyxels hardly
// reach around it, come nearer to it.
TEST(MassCentres, PiecesHaveTheFirstMomentOfTheirNodes) {
    std::size_t exact = 0, compared = 0;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
        Scene scene(seed);
        Random random(seed);
        for (std::int32_t piece = 1; piece < 12; ++piece) {
            const auto parent = static_cast<std::int32_t>(random.below(static_cast<std::uint32_t>(piece)));
            const Vec3 normal = random_vector(random, 1).normalized();
            scene.part(normal, random.uniform(-0.1, 0.1), parent, piece);
            const MassLumping lumping =
                lump(scene.material_nodes(), scene.phyxels, scene.locator, fixtures::two_threads());
            apply(lumping, scene.material_nodes(), scene.density, scene.phyxels);
            std::vector<double> plain(scene.phyxels.size());
            for (std::size_t i = 0; i < plain.size(); ++i) {
                plain[i] = scene.density * scene.phyxels.volume[i];
                EXPECT_GE(scene.phyxels.mass[i], 0.299 * plain[i]);
            }
            const auto count = static_cast<std::size_t>(piece + 1);
            const std::vector<Vec3> before = lacking_moments(scene, plain, count);
            const std::vector<Vec3> after = lacking_moments(scene, scene.phyxels.mass, count);
            std::vector<double> mass(count, 0), members(count, 0);
            for (std::size_t i = 0; i < plain.size(); ++i) {
                mass[static_cast<std::size_t>(scene.phyxels.piece[i])] += scene.phyxels.mass[i];
                members[static_cast<std::size_t>(scene.phyxels.piece[i])] += 1;
            }
            for (std::size_t k = 0; k < count; ++k) {
                if (!(members[k] > 0)) continue;
                const double wanted = scene.density * scene.piece_volume(static_cast<std::int32_t>(k));
                const double rounding = 1e-13 * wanted;
                EXPECT_NEAR(mass[k], wanted, rounding);
                EXPECT_LE(after[k].norm(), before[k].norm() + rounding) << seed << " " << k;
                if (members[k] >= 40) EXPECT_LE(after[k].norm(), rounding) << seed << " " << k;
                exact += after[k].norm() <= rounding;
                compared += 1;
            }
        }
    }
    EXPECT_GT(2 * exact, compared);
    EXPECT_GT(compared, 400U);
}

// One phyxel, phyxels on a line and phyxels in a plane, beside nodes all around.
TEST(MassCentres, StayWhereAPieceHasNoExtent) {
    Random random(3);
    for (int dimensions = 0; dimensions < 3; ++dimensions) {
        Scene scene(9);
        scene.phyxels = Phyxels{};
        for (int k = 0; k < (dimensions > 0 ? 30 : 1); ++k) {
            Vec3 at = Vec3::Zero();
            for (int axis = 0; axis < dimensions; ++axis) at[axis] = random.uniform(-0.2, 0.2);
            scene.phyxels.append(at, 0.02);
            scene.phyxels.support_radius.back() = 0.08;
        }
        scene.locator = PhyxelLocator(scene.phyxels.rest_position, 0.06);
        const MassLumping lumping =
            lump(scene.material_nodes(), scene.phyxels, scene.locator, fixtures::two_threads());
        apply(lumping, scene.material_nodes(), scene.density, scene.phyxels);
        const double mass = scene.density * scene.piece_volume(0);
        const Vec3 lacking = lacking_moments(scene, scene.phyxels.mass, 1)[0];
        for (int axis = 0; axis < dimensions; ++axis)
            EXPECT_NEAR(lacking[axis], 0, 1e-12 * mass) << dimensions << " " << axis;
        double sum = 0;
        for (const double m : scene.phyxels.mass) {
            EXPECT_GT(m, 0);
            sum += m;
        }
        EXPECT_NEAR(sum, mass, 1e-12 * mass);
    }
}

}  // namespace
}  // namespace splitcubes::meshless
