#include "dynamics/bodies.h"

#include <gtest/gtest.h>
#include <splitcubes/core/error.h>

#include <algorithm>

namespace splitcubes::meshless {
namespace {

using fixtures::block;
using fixtures::Specimen;

Specimen scattered(int count, std::uint64_t seed, const Parallel& parallel) {
    Random random(seed);
    Specimen body;
    for (int i = 0; i < count; ++i) body.add(fixtures::random_vector(random, 0.2), 0.05, i % 2);
    body.connect(parallel);
    return body;
}

TEST(Locator, EqualsBruteForce) {
    Random random(1);
    std::vector<Vec3> points;
    for (int i = 0; i < 400; ++i)
        points.push_back(fixtures::random_vector(random, 1).cwiseProduct(Vec3(1, 2, 0.1)));
    points.push_back(Vec3(900, 0, 0));  // far away: the grid must stay small
    const PhyxelLocator locator(points, 0.2);
    std::vector<std::uint32_t> found, wanted;
    for (int trial = 0; trial < 200; ++trial) {
        const Vec3 point = fixtures::random_vector(random, 2);
        const double radius = random.uniform(0, 1);
        wanted.clear();
        for (std::uint32_t i = 0; i < points.size(); ++i)
            if ((points[i] - point).squaredNorm() < radius * radius) wanted.push_back(i);
        locator.near(point, radius, found);
        EXPECT_EQ(found, wanted);

        std::vector<std::pair<double, std::uint32_t>> all;
        for (std::uint32_t i = 0; i < points.size(); ++i)
            all.emplace_back((points[i] - point).squaredNorm(), i);
        std::sort(all.begin(), all.end());
        locator.nearest(point, 7, found);
        ASSERT_EQ(found.size(), 7U);
        for (std::size_t k = 0; k < 7; ++k) EXPECT_EQ(found[k], all[k].second);
    }
    locator.nearest(Vec3::Zero(), 1000, found);
    EXPECT_EQ(found.size(), points.size());
}

TEST(Pairs, AreWithinTheLargerSupportAndOnePiece) {
    const Parallel parallel(2);
    const Specimen body = scattered(300, 2, parallel);
    const Phyxels& p = body.phyxels;
    std::size_t k = 0;
    for (std::uint32_t a = 0; a < p.size(); ++a)
        for (std::uint32_t b = a + 1; b < p.size(); ++b) {
            const double reach = std::max(p.support_radius[a], p.support_radius[b]);
            if (p.piece[a] != p.piece[b] || (p.rest_position[a] - p.rest_position[b]).norm() >= reach)
                continue;
            ASSERT_LT(k, body.pairs.size());
            EXPECT_EQ(body.pairs.a[k], a);
            EXPECT_EQ(body.pairs.b[k], b);
            ++k;
        }
    EXPECT_EQ(k, body.pairs.size());
}

TEST(Pairs, LatticeHasTheUsualNeighbourCount) {
    const Parallel parallel(1);
    const Specimen body = block(10, 10, 8, 0.05, Material{}, parallel);
    const double mean = static_cast<double>(body.neighbourhoods.link_count()) / 800;
    EXPECT_GT(mean, 18);
    EXPECT_LT(mean, 26);
}

template <class Span>
void expect_same(const Span& a, const Span& b, const char* what) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) ASSERT_TRUE(a[k] == b[k]) << what << " " << k;
}

// Compares the links of each row, wherever they lie.
void expect_equal_links(const Neighbourhoods& a, const Neighbourhoods& b) {
    for (std::size_t i = 0; i < a.size(); ++i) {
        const std::size_t count = a.links_end(i) - a.links_begin(i);
        ASSERT_EQ(count, b.links_end(i) - b.links_begin(i)) << i;
        for (std::size_t k = 0; k < count; ++k) {
            const std::size_t l = a.links_begin(i) + k, m = b.links_begin(i) + k;
            ASSERT_EQ(a.neighbour()[l], b.neighbour()[m]);
            ASSERT_EQ(a.pair()[l], b.pair()[m]);
            ASSERT_EQ(a.rest_edge()[l], b.rest_edge()[m]);
            ASSERT_EQ(a.weight()[l], b.weight()[m]);
            ASSERT_EQ(a.gradient()[l], b.gradient()[m]);
            ASSERT_EQ(a.reverse_gradient()[l], b.reverse_gradient()[m]);
            ASSERT_EQ(a.reverse()[a.reverse()[l]], l);
            ASSERT_EQ(a.neighbour()[a.reverse()[l]], i);
        }
    }
}

// Compares the columns of each slice, wherever they lie.
void expect_equal_slices(const LinkSlices& a, const LinkSlices& b) {
    constexpr std::size_t lanes = LinkSlices::lanes;
    ASSERT_EQ(a.slice_count(), b.slice_count());
    ASSERT_EQ(a.column_count(), b.column_count());
    ASSERT_EQ(a.gather_count(), b.gather_count());
    ASSERT_EQ(a.weights_pay(), b.weights_pay());
    ASSERT_EQ(a.bytes(), b.bytes());
    for (std::size_t slice = 0; slice < a.slice_count(); ++slice) {
        const std::size_t count = a.column_end(slice) - a.column_begin(slice);
        ASSERT_EQ(count, b.column_end(slice) - b.column_begin(slice)) << slice;
        for (std::size_t k = 0; k < count; ++k) {
            const std::size_t c = a.column_begin(slice) + k, d = b.column_begin(slice) + k;
            const auto same = [&](const auto* one, const auto* other, std::size_t of, std::size_t numbers,
                                  std::size_t to) {
                return std::equal(one + of * numbers, one + (of + 1) * numbers, other + to * numbers);
            };
            ASSERT_TRUE(same(a.forward(), b.forward(), c, 4 * lanes, d));
            ASSERT_TRUE(same(a.backward(), b.backward(), c, 3 * lanes, d));
            ASSERT_TRUE(same(a.forward_weight(), b.forward_weight(), c, 2 * lanes, d));
            ASSERT_TRUE(same(a.backward_weight(), b.backward_weight(), c, lanes, d));
            const std::int32_t run = a.run()[c], other = b.run()[d];
            if (run >= 0 || other >= 0)
                ASSERT_EQ(run, other);
            else
                ASSERT_TRUE(same(a.index(), b.index(), static_cast<std::size_t>(~run), lanes,
                                 static_cast<std::size_t>(~other)));
            const std::int32_t at = a.edge_at()[c], place = b.edge_at()[d];
            ASSERT_EQ(at >= 0, place >= 0);
            const float* const edge = a.edge() + (at >= 0 ? at : ~at);
            ASSERT_TRUE(
                std::equal(edge, edge + (at >= 0 ? 3 : 3 * lanes), b.edge() + (place >= 0 ? place : ~place)));
        }
    }
    expect_same(a.deficient(), b.deficient(), "deficient");
    const std::size_t rows = a.stride();
    expect_same(std::span(a.rest_position(), 3 * rows), std::span(b.rest_position(), 3 * rows), "positions");
    expect_same(std::span(a.volume(), rows), std::span(b.volume(), rows), "volume");
    expect_same(std::span(a.penalty(), rows), std::span(b.penalty(), rows), "penalties");
    expect_same(std::span(a.gradient_sum(), 3 * rows), std::span(b.gradient_sum(), 3 * rows), "sums");
    expect_same(std::span(a.penalty_moment(), 6 * rows), std::span(b.penalty_moment(), 6 * rows), "moments");
    expect_same(std::span(a.inverse_moment(), 6 * rows), std::span(b.inverse_moment(), 6 * rows),
                "inverse moments");
    expect_same(std::span(a.edge_sum(), 3 * rows), std::span(b.edge_sum(), 3 * rows), "edge sums");
}

void expect_equal(const Neighbourhoods& a, const Neighbourhoods& b) {
    ASSERT_EQ(a.size(), b.size());
    ASSERT_EQ(a.link_count(), b.link_count());
    expect_same(a.rank(), b.rank(), "rank");
    expect_same(a.basis(), b.basis(), "basis");
    expect_same(a.gradient_sum(), b.gradient_sum(), "gradient sum");
    expect_same(a.stiffness_diagonal(), b.stiffness_diagonal(), "diagonal");
    expect_same(a.moment(), b.moment(), "moment");
    expect_same(a.penalty(), b.penalty(), "penalty");
    expect_equal_links(a, b);
    expect_equal_slices(a.slices(), b.slices());
}

// Holds begin and end between cuts. Rows are functions of what is held and visible, whatever came before.
TEST(Neighbourhoods, RowsOfHeldPhyxelsEqualARebuild) {
    const Parallel one(1), two(2);
    Specimen body = block(7, 6, 5, 0.05, Material{}, one);
    Random random(7);
    for (int round = 0; round < 16; ++round) {
        const Vec3 point = fixtures::random_vector(random, 0.15), normal = fixtures::random_vector(random, 1);
        const bool is_held = random.below(3) != 0;
        for (std::size_t i = 0; i < body.phyxels.size(); ++i)
            if (normal.dot(body.phyxels.rest_position[i] - point) > 0) body.phyxels.held[i] = is_held;
        body.neighbourhoods.update_held(body.phyxels, body.pairs, body.material, two);
        const std::vector<std::uint32_t> changed = fixtures::cut_by_plane(
            body, fixtures::random_vector(random, 0.1), fixtures::random_vector(random, 1));
        if (round % 3 == 1)
            body.neighbourhoods.update(body.phyxels, body.pairs, changed, body.material, two);
        else
            for (const std::uint32_t p : changed) body.pairs.visibility[p] = 1;
        body.phyxels.volume[random.below(100)] *= 0.7;
        body.neighbourhoods.refresh_volumes(body.phyxels, body.material, two);
        EXPECT_FALSE(body.neighbourhoods.update_held(body.phyxels, body.pairs, body.material, two));
        Neighbourhoods fresh;
        fresh.rebuild(body.phyxels, body.pairs, body.material, one);
        expect_equal(body.neighbourhoods, fresh);
    }
    body.phyxels.held.assign(body.phyxels.size(), 0);
    EXPECT_TRUE(body.neighbourhoods.update_held(body.phyxels, body.pairs, body.material, two));
    for (std::size_t i = 0; i < body.phyxels.size(); ++i)
        EXPECT_EQ(body.neighbourhoods.volume()[i], body.phyxels.volume[i]);
}

// A phyxel that is held alone, or amid free ones, keeps its row.
TEST(Neighbourhoods, HoldsWithFreePhyxelsOnBothSidesChangeNothing) {
    const Parallel one(1);
    Specimen body = block(7, 7, 7, 0.05, Material{}, one);
    for (std::size_t i = 0; i < body.phyxels.size(); ++i) {
        const Vec3& rest = body.phyxels.rest_position[i];
        body.phyxels.held[i] = rest.norm() < 1e-9 || std::abs(rest.x() - 0.1) < 1e-9;
    }
    const Neighbourhoods before = body.neighbourhoods;
    body.neighbourhoods.update_held(body.phyxels, body.pairs, body.material, one);
    for (std::size_t l = 0; l < before.link_count(); ++l)
        EXPECT_NEAR(body.neighbourhoods.weight()[l], before.weight()[l], 1e-6 * before.weight()[l]);
    for (std::size_t i = 0; i < before.size(); ++i)
        EXPECT_NEAR(body.neighbourhoods.volume()[i], before.volume()[i], 1e-6 * before.volume()[i]);
}

TEST(Neighbourhoods, UpdateEqualsRebuild) {
    const Parallel one(1), two(2);
    Specimen body = block(7, 6, 5, 0.05, Material{}, one);
    Random random(3);
    for (int cut = 0; cut < 12; ++cut) {
        std::vector<std::uint32_t> changed = fixtures::cut_by_plane(
            body, fixtures::random_vector(random, 0.1), fixtures::random_vector(random, 1));
        // Includes partial visibility and a pair listed twice.
        const auto p =
            static_cast<std::uint32_t>(random.below(static_cast<std::uint32_t>(body.pairs.size())));
        body.pairs.visibility[p] *= 0.5F;
        changed.push_back(p);
        changed.push_back(p);
        body.neighbourhoods.update(body.phyxels, body.pairs, changed, body.material, two);
        Neighbourhoods fresh;
        fresh.rebuild(body.phyxels, body.pairs, body.material, one);
        expect_equal(body.neighbourhoods, fresh);
    }
}

// The balance does not give a link back what a cut took from it.
TEST(Neighbourhoods, WeightsAreProportionalToVisibility) {
    const Parallel one(1);
    Specimen body = block(7, 6, 5, 0.05, Material{}, one);
    const std::vector<double> whole(body.neighbourhoods.weight().begin(), body.neighbourhoods.weight().end());
    Random random(5);
    for (float& visibility : body.pairs.visibility) visibility = static_cast<float>(random.uniform(0.25, 1));
    body.neighbourhoods.rebuild(body.phyxels, body.pairs, body.material, one);
    for (std::size_t l = 0; l < whole.size(); ++l) {
        const auto visibility = static_cast<double>(body.pairs.visibility[body.neighbourhoods.pair()[l]]);
        ASSERT_NEAR(body.neighbourhoods.weight()[l], visibility * whole[l], 1e-12 * whole[l]);
    }
}

// The weakest links fade out of the balance: no weight jumps as one comes out of sight.
TEST(Neighbourhoods, WeightsFadeWithTheLastVisibility) {
    const Parallel one(1);
    Specimen body = block(7, 6, 5, 0.05, Material{}, one);
    Random random(6);
    for (int k = 0; k < 20; ++k)
        body.pairs.visibility[random.below(static_cast<std::uint32_t>(body.pairs.size()))] = 1e-7F;
    body.neighbourhoods.rebuild(body.phyxels, body.pairs, body.material, one);
    const std::vector<double> seen(body.neighbourhoods.weight().begin(), body.neighbourhoods.weight().end());
    for (float& visibility : body.pairs.visibility)
        if (visibility < 1) visibility = 0;
    body.neighbourhoods.rebuild(body.phyxels, body.pairs, body.material, one);
    const double largest = *std::max_element(seen.begin(), seen.end());
    for (std::size_t l = 0; l < seen.size(); ++l)
        ASSERT_NEAR(body.neighbourhoods.weight()[l], seen[l], 1e-4 * largest);
}

// Phyxels come singly and in groups, between cuts, until the pools have been compacted.
TEST(Neighbourhoods, AppendEqualsRebuild) {
    const Parallel one(1), two(2);
    for (const bool lattice : {true, false}) {
        Specimen body = lattice ? block(7, 6, 5, 0.05, Material{}, one) : scattered(150, 9, one);
        Random random(lattice ? 21 : 22);
        for (int step = 0; step < 60; ++step) {
            std::vector<std::uint32_t> changed;
            if (step % 4 == 0)
                changed = fixtures::cut_by_plane(body, fixtures::random_vector(random, 0.1),
                                                 fixtures::random_vector(random, 1));
            const std::size_t known = body.phyxels.size();
            for (std::uint32_t k = random.below(9); k > 0; --k)
                body.add(fixtures::random_vector(random, 0.15), 0.05);
            const PhyxelLocator locator(body.phyxels.rest_position, 0.1);
            compute_support_radii(body.phyxels, locator, two, {}, known);
            const std::size_t known_pairs = body.pairs.size();
            append_pairs(body.phyxels, locator, known, body.pairs, two);
            for (std::size_t p = known_pairs; p < body.pairs.size(); p += 3) body.pairs.visibility[p] = 0.5F;
            if (step % 7 == 3) {  // or links alone, or nothing
                body.neighbourhoods.append(body.phyxels, body.pairs, {}, body.material, two);
                body.neighbourhoods.update(body.phyxels, body.pairs, changed, body.material, two);
            } else {
                body.neighbourhoods.append(body.phyxels, body.pairs, changed, body.material, two);
            }
            Neighbourhoods fresh;
            fresh.rebuild(body.phyxels, body.pairs, body.material, one);
            expect_equal(body.neighbourhoods, fresh);
            if (testing::Test::HasFatalFailure()) return;
        }
    }
}

// The pairs are those of a search among all phyxels, in an order that keeps rows ascending.
TEST(Pairs, AppendedPairsCompleteTheSearch) {
    const Parallel parallel(2);
    Specimen body = scattered(200, 12, parallel);
    Random random(13);
    for (int step = 0; step < 6; ++step) {
        const std::size_t known = body.phyxels.size();
        for (int k = 0; k < 5; ++k) body.add(fixtures::random_vector(random, 0.15), 0.05);
        const PhyxelLocator locator(body.phyxels.rest_position, 0.1);
        compute_support_radii(body.phyxels, locator, parallel, {}, known);
        append_pairs(body.phyxels, locator, known, body.pairs, parallel);
        const Pairs all = find_pairs(body.phyxels, locator, parallel);
        std::vector<std::pair<std::uint32_t, std::uint32_t>> found, wanted;
        for (std::size_t p = 0; p < body.pairs.size(); ++p)
            found.emplace_back(body.pairs.a[p], body.pairs.b[p]);
        for (std::size_t p = 0; p < all.size(); ++p) wanted.emplace_back(all.a[p], all.b[p]);
        std::sort(found.begin(), found.end());
        EXPECT_EQ(found, wanted);
    }
}

TEST(Neighbourhoods, LinksAreConsistent) {
    const Parallel parallel(1);
    Specimen body = scattered(300, 4, parallel);
    fixtures::cut_randomly(body, 3, 0.1, 5, parallel);
    const Neighbourhoods& links = body.neighbourhoods;
    for (std::uint32_t i = 0; i < links.size(); ++i)
        for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l) {
            const std::uint32_t j = links.neighbour()[l];
            EXPECT_EQ(links.rest_edge()[l], body.phyxels.rest_position[j] - body.phyxels.rest_position[i]);
            if (l > links.links_begin(i)) {
                EXPECT_LT(links.neighbour()[l - 1], j);
            }
            bool found = false;
            for (std::uint32_t back = links.links_begin(j); back < links.links_end(j); ++back) {
                if (links.neighbour()[back] != i) continue;
                found = true;
                EXPECT_EQ(links.reverse_gradient()[l], links.gradient()[back]);
                EXPECT_EQ(links.reverse()[l], back);
            }
            EXPECT_TRUE(found);
        }
}

TEST(Neighbourhoods, GradientsAreExactForLinearFields) {
    const Parallel parallel(1);
    Specimen body = scattered(400, 6, parallel);
    Random random(7);
    const Mat3 A = Mat3::Identity() + 0.5 * fixtures::random_rotation(random);
    std::vector<Vec3> position(body.phyxels.size());
    for (std::size_t i = 0; i < position.size(); ++i)
        position[i] = A * body.phyxels.rest_position[i] + Vec3(1, 2, 3);
    std::vector<Mat3> F(position.size()), R(position.size(), Mat3::Identity());
    compute_deformation(body.neighbourhoods, body.phyxels.rest_position, position, R, F, R, parallel);
    std::size_t full = 0;
    for (std::size_t i = 0; i < position.size(); ++i) {
        if (body.neighbourhoods.rank()[i] < 3) continue;
        ++full;
        EXPECT_LT((F[i] - A).norm(), 1e-11);
    }
    EXPECT_GT(full, 300U);
}

TEST(Neighbourhoods, RankCountsTheIndependentDirections) {
    const Parallel parallel(1);
    EXPECT_EQ(block(1, 1, 1, 0.1, Material{}, parallel).neighbourhoods.rank()[0], 0);
    const Specimen line = block(6, 1, 1, 0.1, Material{}, parallel);
    const Specimen plane = block(6, 6, 1, 0.1, Material{}, parallel);
    const Specimen solid = block(6, 6, 6, 0.1, Material{}, parallel);
    for (const auto rank : line.neighbourhoods.rank()) EXPECT_EQ(rank, 1);
    for (const auto rank : plane.neighbourhoods.rank()) EXPECT_EQ(rank, 2);
    for (const auto rank : solid.neighbourhoods.rank()) EXPECT_EQ(rank, 3);
}

TEST(Material, RejectsUnphysicalParameters) {
    EXPECT_NO_THROW(check_material(Material{}, "body"));
    const auto rejects = [](auto change) {
        Material material;
        change(material);
        EXPECT_THROW(check_material(material, "body"), InputError);
    };
    rejects([](Material& m) { m.density = 0; });
    rejects([](Material& m) { m.youngs_modulus = std::nan(""); });
    rejects([](Material& m) { m.poisson_ratio = 0.5; });
    rejects([](Material& m) { m.poisson_ratio = -0.1; });
    rejects([](Material& m) { m.mass_damping = -1; });
    rejects([](Material& m) { m.stiffness_damping = -1; });
    rejects([](Material& m) { m.zero_energy = -0.1; });
}

}  // namespace
}  // namespace splitcubes::meshless
