#include "samples/lumping_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace splitcubes::meshless {
namespace {

using fixtures::random_vector;
using Scene = fixtures::LumpingScene;

const Parallel threads(2);

TEST(MassLumping, SharesSumToOneWithinThePiece) {
    Scene scene(1);
    scene.part(0.01, 1);
    const MassLumping lumping = lump(scene.material_nodes(), scene.phyxels, scene.locator, threads);
    EXPECT_EQ(lumping.unlumped(), 0U);
    for (std::size_t b = 0; b < scene.nodes.size(); ++b) {
        double sum = 0;
        for (const std::uint32_t i : lumping.phyxels_of(b))
            EXPECT_EQ(scene.phyxels.piece[i], scene.pieces[b]);
        for (const double share : lumping.shares_of(b)) sum += share;
        EXPECT_NEAR(sum, 1, 1e-14);
    }
}

// A lattice of phyxels in a box with four nodes per spacing, whole or cut by a slanted plane.
struct Lattice {
    Phyxels phyxels;
    std::vector<Vec3> nodes;
    std::vector<double> volumes;
    std::vector<std::int32_t> pieces;
    PhyxelLocator locator;

    Lattice(const Vec3i& count, double separated_at) {
        const auto piece_of = [&](const Vec3& x) {
            return x.dot(Vec3(1, 0.3, -0.2)) > separated_at ? std::int32_t{1} : std::int32_t{0};
        };
        const auto each = [&](int fine, const auto& use) {
            for (int z = 0; z < fine * count[2]; ++z)
                for (int y = 0; y < fine * count[1]; ++y)
                    for (int x = 0; x < fine * count[0]; ++x)
                        use(Vec3((Vec3(x, y, z) + Vec3::Constant(0.5)) / fine - 0.5 * count.cast<double>()));
        };
        each(1, [&](const Vec3& x) {
            phyxels.append(x, 1, piece_of(x));
            phyxels.support_radius.back() = 1.6;
        });
        each(4, [&](const Vec3& x) {
            nodes.push_back(x);
            volumes.push_back(1.0 / 64);
            pieces.push_back(piece_of(x));
        });
        locator = PhyxelLocator(phyxels.rest_position, 1.6);
    }
};

TEST(MassLumping, PhyxelsHaveTheMomentsOfTheirNodes) {
    for (const double separated_at : {1e9, 0.4, 1.1}) {
        Lattice lattice({8, 6, 5}, separated_at);
        const MaterialNodes nodes{lattice.nodes, lattice.volumes, lattice.pieces};
        apply(lump(nodes, lattice.phyxels, lattice.locator, threads), nodes, 1, lattice.phyxels);
        Phyxels of_nodes;
        for (std::size_t b = 0; b < lattice.nodes.size(); ++b) {
            of_nodes.append(lattice.nodes[b], 1, lattice.pieces[b]);
            of_nodes.mass.back() = lattice.volumes[b];
        }
        std::vector<Momenta> now, wanted;
        momenta_of_pieces(lattice.phyxels, 2, now);
        momenta_of_pieces(of_nodes, 2, wanted);
        for (std::size_t k = 0; k < (separated_at > 100 ? 1U : 2U); ++k) {
            EXPECT_NEAR(now[k].mass, wanted[k].mass, 1e-12 * wanted[k].mass);
            EXPECT_LT((now[k].centre - wanted[k].centre).norm(), 1e-12) << separated_at << ": spacings";
            EXPECT_LT((now[k].inertia - wanted[k].inertia).norm(), 0.035 * wanted[k].inertia.norm())
                << separated_at;
        }
        for (const double volume : lattice.phyxels.volume) EXPECT_GT(volume, 0.1);
    }
}

void expect_same_lumping(const MassLumping& a, const MassLumping& b) {
    ASSERT_EQ(a.node_count(), b.node_count());
    for (std::size_t node = 0; node < a.node_count(); ++node) {
        ASSERT_TRUE(std::ranges::equal(a.phyxels_of(node), b.phyxels_of(node))) << node;
        ASSERT_TRUE(std::ranges::equal(a.shares_of(node), b.shares_of(node))) << node;
    }
    ASSERT_EQ(a.volume.size(), b.volume.size());
    for (std::size_t i = 0; i < a.volume.size(); ++i) {
        ASSERT_EQ(a.volume[i].plain, b.volume[i].plain) << i;
        ASSERT_EQ(a.volume[i].corrected, b.volume[i].corrected) << i;
    }
    EXPECT_EQ(a.transfers, b.transfers);
    EXPECT_EQ(a.unit, b.unit);
    EXPECT_EQ(a.piece, b.piece);
    EXPECT_EQ(a.phyxel_piece, b.phyxel_piece);
}

TEST(MassLumping, RelumpingEqualsLumpingFromScratch) {
    Lattice lattice({8, 6, 5}, 1e9);
    const Lattice separated({8, 6, 5}, 0.4);
    const MaterialNodes nodes{separated.nodes, separated.volumes, separated.pieces};
    MassLumping lumping =
        lump({lattice.nodes, lattice.volumes, lattice.pieces}, lattice.phyxels, lattice.locator, threads);
    lattice.phyxels.piece = separated.phyxels.piece;
    relump_after_split(lumping, nodes, 1, lattice.locator, lattice.phyxels, threads);
    const MassLumping fresh = lump(nodes, separated.phyxels, separated.locator, threads);
    expect_same_lumping(lumping, fresh);
}

// Any number of splits and of new phyxels, in any order.
TEST(MassLumping, RelumpingAgainAndAgainEqualsLumpingFromScratch) {
    for (std::uint64_t seed = 10; seed < 16; ++seed) {
        Scene scene(seed);
        Random random(seed);
        MassLumping lumping = lump(scene.material_nodes(), scene.phyxels, scene.locator, threads);
        apply(lumping, scene.material_nodes(), scene.density, scene.phyxels);
        std::int32_t pieces = 1;
        for (int step = 0; step < 12; ++step) {
            // A random plane parts one piece.
            const Vec3 normal = random_vector(random, 1);
            const double offset = random.uniform(-0.1, 0.1);
            const auto parent = static_cast<std::int32_t>(random.below(static_cast<std::uint32_t>(pieces)));
            scene.part(normal, offset, parent, pieces);
            ++pieces;
            for (std::uint32_t k = random.below(4); k > 0; --k) {
                PhyxelStart start;
                start.rest_position = random_vector(random, 0.2);
                start.piece = static_cast<std::int32_t>(random.below(static_cast<std::uint32_t>(pieces)));
                start.support_radius = random.uniform(0.03, 0.12);
                scene.phyxels.append(start);
            }
            scene.locator = PhyxelLocator(scene.phyxels.rest_position, 0.06);
            relump_after_split(lumping, scene.material_nodes(), scene.density, scene.locator, scene.phyxels,
                               threads);
            const MassLumping fresh = lump(scene.material_nodes(), scene.phyxels, scene.locator, threads);
            expect_same_lumping(lumping, fresh);
            Phyxels weighed = scene.phyxels;
            apply(fresh, scene.material_nodes(), scene.density, weighed);
            EXPECT_EQ(scene.phyxels.volume, weighed.volume);
            EXPECT_EQ(scene.phyxels.mass, weighed.mass);
            for (std::size_t i = 0; i < weighed.size(); ++i)
                EXPECT_GE(weighed.volume[i],
                          0.2999 * lumping.unit * static_cast<double>(lumping.volume[i].plain));
        }
    }
}

// Phyxels and nodes that are their own mirror image, in random order.
TEST(MassLumping, MirrorImagesHaveEqualVolumes) {
    std::size_t transfers = 0;
    for (std::uint64_t seed = 20; seed < 26; ++seed) {
        Random random(seed);
        const auto mirrored = [](const Vec3& x) { return Vec3(-x.x(), x.y(), x.z()); };
        std::vector<Vec3> places, nodes;
        std::vector<double> radii, volumes;
        for (int k = 0; k < 100; ++k) {
            places.push_back(random_vector(random, 0.2));
            places.push_back(mirrored(places.back()));
            radii.resize(places.size(), random.uniform(0.04, 0.09));
        }
        for (int k = 0; k < 1000; ++k) {
            nodes.push_back(random_vector(random, 0.2));
            nodes.push_back(mirrored(nodes.back()));
            volumes.resize(nodes.size(), random.uniform(0.2, 1) * 3e-5);
        }
        std::vector<std::uint32_t> index(places.size());
        std::iota(index.begin(), index.end(), 0U);
        for (std::size_t k = index.size() - 1; k > 0; --k)
            std::swap(index[k], index[random.below(static_cast<std::uint32_t>(k + 1))]);
        Phyxels phyxels;
        for (const std::uint32_t place : index) {
            phyxels.append(places[place], 0.02);
            phyxels.support_radius.back() = radii[place];
        }
        const std::vector<std::int32_t> pieces(nodes.size(), 0);
        const PhyxelLocator locator(phyxels.rest_position, 0.06);
        const MassLumping lumping = lump({nodes, volumes, pieces}, phyxels, locator, threads);
        apply(lumping, {nodes, volumes, pieces}, 1, phyxels);
        transfers += lumping.transfers.size();
        std::vector<double> volume(places.size());
        for (std::size_t i = 0; i < index.size(); ++i) volume[index[i]] = phyxels.volume[i];
        double total = 0;
        for (const double one : volume) total += one;
        for (std::size_t k = 0; k < volume.size(); k += 2)
            EXPECT_NEAR(volume[k], volume[k + 1], 1e-9 * total / static_cast<double>(volume.size()));
    }
    EXPECT_GT(transfers, 0U);
}

TEST(MassLumping, EveryPieceHasTheMassOfItsNodes) {
    Scene scene(2);
    scene.part(0.01, 1);
    apply(lump(scene.material_nodes(), scene.phyxels, scene.locator, threads), scene.material_nodes(),
          scene.density, scene.phyxels);
    std::vector<Momenta> pieces;
    momenta_of_pieces(scene.phyxels, 2, pieces);
    for (std::int32_t k = 0; k < 2; ++k) {
        const double expected = scene.density * scene.piece_volume(k);
        EXPECT_NEAR(pieces[static_cast<std::size_t>(k)].mass, expected, 1e-13 * expected);
    }
}

TEST(MassLumping, NodesOutOfReachGoToTheNearestPhyxel) {
    Phyxels phyxels;
    for (const double x : {0.0, 1.0, 3.0}) phyxels.append(Vec3(x, 0, 0), 0.1, x > 2);
    for (double& h : phyxels.support_radius) h = 0.1;
    const std::vector<Vec3> nodes{Vec3(0.4, 0, 0), Vec3(0.5, 0, 0), Vec3(2.9, 0.5, 0), Vec3(0, 0, 0)};
    const std::vector<double> volumes(4, 1);
    const std::vector<std::int32_t> pieces{0, 0, 0, 7};
    const PhyxelLocator locator(phyxels.rest_position, 0.1);
    const MassLumping lumping = lump({nodes, volumes, pieces}, phyxels, locator, threads);
    EXPECT_EQ(lumping.phyxel, (std::vector<std::uint32_t>{0, 0, 1}))
        << "of its own piece, the lower of equals";
    EXPECT_EQ(lumping.unlumped(), 1U) << "a piece without phyxels";
}

TEST(MassLumping, RelumpingKeepsMassMomentumAndAngularMomentum) {
    Scene scene(3);
    MassLumping lumping = lump(scene.material_nodes(), scene.phyxels, scene.locator, threads);
    apply(lumping, scene.material_nodes(), scene.density, scene.phyxels);
    const MassLumping old = lumping;
    const Phyxels before = scene.phyxels;
    const Momenta whole = total_momenta(before);
    scene.part(0.01, 1);
    relump_after_split(lumping, scene.material_nodes(), scene.density, scene.locator, scene.phyxels, threads);

    std::vector<Momenta> pieces;
    momenta_of_pieces(scene.phyxels, 2, pieces);
    const Vec3 drift = whole.linear / whole.mass;
    Vec3 total_angular_momentum = Vec3::Zero(), total_linear = Vec3::Zero();
    double total_mass = 0;
    for (std::size_t k = 0; k < 2; ++k) {
        // Momenta of the piece's nodes under the old shares.
        Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
        const auto add = [&](std::uint32_t i, double m) {
            linear += m * before.velocity[i];
            angular += m * (before.position[i] - whole.centre).cross(before.velocity[i] - drift);
        };
        for (std::size_t b = 0; b < scene.nodes.size(); ++b) {
            if (scene.pieces[b] != static_cast<std::int32_t>(k)) continue;
            for (std::size_t e = 0; e < old.phyxels_of(b).size(); ++e)
                add(old.phyxels_of(b)[e], scene.density * scene.volumes[b] * old.shares_of(b)[e]);
        }
        // Transferred volume belongs to the nodes of the phyxel that gave it.
        for (const MassLumping::Transfer& transfer : old.transfers) {
            const double m = scene.density * old.unit * static_cast<double>(transfer.volume);
            if (scene.phyxels.piece[transfer.from] != static_cast<std::int32_t>(k)) continue;
            add(transfer.from, -m);
            add(transfer.to, m);
        }
        // What keeps the centre of mass stays with its phyxel, with what moves relative to the whole.
        for (std::size_t i = 0; i < before.size(); ++i) {
            if (scene.phyxels.piece[i] != static_cast<std::int32_t>(k)) continue;
            const double m = before.mass[i] - scene.density * before.volume[i];
            linear += m * (before.velocity[i] - drift);
            angular += m * (before.position[i] - whole.centre).cross(before.velocity[i] - drift);
        }
        EXPECT_LT((pieces[k].linear - linear).norm(), 1e-12 * whole.linear.norm());
        const Vec3 now = pieces[k].angular_momentum +
                         (pieces[k].centre - whole.centre).cross(pieces[k].linear - pieces[k].mass * drift);
        EXPECT_LT((now - angular).norm(), 1e-12 * whole.mass);
        total_mass += pieces[k].mass;
        total_linear += pieces[k].linear;
        total_angular_momentum += now;
    }
    EXPECT_NEAR(total_mass, whole.mass, 1e-13 * whole.mass);
    EXPECT_LT((total_linear - whole.linear).norm(), 1e-12 * whole.linear.norm());
    EXPECT_LT((total_angular_momentum - whole.angular_momentum).norm(), 1e-12 * whole.mass);
}

TEST(MassLumping, RelumpingIsGalileanInvariant) {
    Scene still(4), fast(4);
    const Vec3 boost(0, 20, -30);
    for (Vec3& v : fast.phyxels.velocity) v += boost;
    for (Scene* scene : {&still, &fast}) {
        MassLumping lumping = lump(scene->material_nodes(), scene->phyxels, scene->locator, threads);
        apply(lumping, scene->material_nodes(), scene->density, scene->phyxels);
        scene->part(0.05, 1);
        relump_after_split(lumping, scene->material_nodes(), scene->density, scene->locator, scene->phyxels,
                           threads);
    }
    for (std::size_t i = 0; i < still.phyxels.size(); ++i)
        EXPECT_LT((fast.phyxels.velocity[i] - boost - still.phyxels.velocity[i]).norm(), 1e-11);
}

TEST(MassLumping, RelumpingLeavesUnchangedPiecesAlone) {
    Scene scene(5);
    scene.part(0.1, 1);
    MassLumping lumping = lump(scene.material_nodes(), scene.phyxels, scene.locator, threads);
    apply(lumping, scene.material_nodes(), scene.density, scene.phyxels);
    const Phyxels before = scene.phyxels;
    // Piece 1 loses its far end to a new piece 2; piece 0 stays.
    scene.part(0.15, 2);
    relump_after_split(lumping, scene.material_nodes(), scene.density, scene.locator, scene.phyxels, threads);
    for (std::size_t i = 0; i < before.size(); ++i) {
        if (scene.phyxels.piece[i] == 0) {
            EXPECT_EQ(scene.phyxels.mass[i], before.mass[i]);
            EXPECT_EQ(scene.phyxels.velocity[i], before.velocity[i]);
        }
    }
    // Without a split nothing changes.
    const Phyxels again = scene.phyxels;
    relump_after_split(lumping, scene.material_nodes(), scene.density, scene.locator, scene.phyxels, threads);
    EXPECT_EQ(scene.phyxels.mass, again.mass);
    EXPECT_EQ(scene.phyxels.velocity, again.velocity);
}

TEST(MassLumping, RelumpingAfterResamplingKeepsMomenta) {
    Scene scene(6);
    MassLumping lumping = lump(scene.material_nodes(), scene.phyxels, scene.locator, threads);
    apply(lumping, scene.material_nodes(), scene.density, scene.phyxels);
    const Momenta before = total_momenta(scene.phyxels);
    Random random(7);
    for (int k = 0; k < 30; ++k) {
        PhyxelStart start;
        start.rest_position = random_vector(random, 0.2);
        start.position = start.rest_position + Vec3(5, -3, 2);
        start.velocity = random_vector(random, 3);
        start.support_radius = 0.05;
        scene.phyxels.append(start);
    }
    scene.locator = PhyxelLocator(scene.phyxels.rest_position, 0.06);
    relump_after_split(lumping, scene.material_nodes(), scene.density, scene.locator, scene.phyxels, threads);
    const Momenta after = total_momenta(scene.phyxels);
    EXPECT_NEAR(after.mass, before.mass, 1e-13 * before.mass);
    EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * before.linear.norm());
    EXPECT_LT((after.angular_momentum - before.angular_momentum).norm(), 1e-12 * before.mass);
}

}  // namespace
}  // namespace splitcubes::meshless
