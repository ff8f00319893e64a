#include "dynamics/bodies.h"

#include <gtest/gtest.h>
#include <splitcubes/core/error.h>

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

TEST(Pairs, CarryVisibility) {
    const Parallel parallel(1);
    Specimen body = block(4, 4, 4, 0.05, Material{}, parallel);
    Pairs known = body.pairs;
    for (std::size_t p = 0; p < known.size(); ++p) known.visibility[p] = static_cast<float>(p % 5) / 4;
    body.add(Vec3(0.02, 0.01, 0), 0.05);
    body.connect(parallel);
    const std::vector<std::uint32_t> fresh = transfer_visibility(known, body.pairs);
    EXPECT_FALSE(fresh.empty());
    std::size_t next = 0;
    for (std::uint32_t p = 0; p < body.pairs.size(); ++p) {
        std::size_t match = known.size();
        for (std::size_t q = 0; q < known.size(); ++q)
            if (known.a[q] == body.pairs.a[p] && known.b[q] == body.pairs.b[p]) match = q;
        if (match < known.size()) {
            EXPECT_EQ(body.pairs.visibility[p], known.visibility[match]);
        } else {
            ASSERT_LT(next, fresh.size());
            EXPECT_EQ(fresh[next++], p);
        }
    }
    EXPECT_EQ(next, fresh.size());
}

template <class Span>
void expect_same(const Span& a, const Span& b, const char* what) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) ASSERT_TRUE(a[k] == b[k]) << what << " " << k;
}

void expect_equal(const Neighbourhoods& a, const Neighbourhoods& b) {
    expect_same(a.offsets(), b.offsets(), "offsets");
    expect_same(a.neighbour(), b.neighbour(), "neighbour");
    expect_same(a.rank(), b.rank(), "rank");
    expect_same(a.basis(), b.basis(), "basis");
    expect_same(a.gradient_sum(), b.gradient_sum(), "gradient sum");
    expect_same(a.stiffness_diagonal(), b.stiffness_diagonal(), "diagonal");
    expect_same(a.gradient(), b.gradient(), "gradient");
    expect_same(a.reverse_gradient(), b.reverse_gradient(), "reverse gradient");
    expect_same(a.weight(), b.weight(), "weight");
    expect_same(a.moment(), b.moment(), "moment");
    expect_same(a.penalty(), b.penalty(), "penalty");
    const LinkSlices &one = a.slices(), &other = b.slices();
    expect_same(one.first_column(), other.first_column(), "columns");
    expect_same(one.run(), other.run(), "runs");
    expect_same(one.deficient(), other.deficient(), "deficient");
    const std::size_t values = one.column_count() * LinkSlices::lanes;
    expect_same(std::span(one.forward(), 4 * values), std::span(other.forward(), 4 * values), "forward");
    expect_same(std::span(one.backward(), 3 * values), std::span(other.backward(), 3 * values), "backward");
    expect_same(std::span(one.forward_weight(), 2 * values), std::span(other.forward_weight(), 2 * values),
                "weights");
    expect_same(std::span(one.backward_weight(), values), std::span(other.backward_weight(), values),
                "weights back");
    expect_same(one.edge_at(), other.edge_at(), "edges");
    const std::size_t rows = one.stride();
    expect_same(std::span(one.volume(), rows), std::span(other.volume(), rows), "volume");
    expect_same(std::span(one.penalty(), rows), std::span(other.penalty(), rows), "penalties");
    expect_same(std::span(one.gradient_sum(), 3 * rows), std::span(other.gradient_sum(), 3 * rows), "sums");
    expect_same(std::span(one.penalty_moment(), 6 * rows), std::span(other.penalty_moment(), 6 * rows),
                "moments");
    expect_same(std::span(one.inverse_moment(), 6 * rows), std::span(other.inverse_moment(), 6 * rows),
                "inverse moments");
    expect_same(std::span(one.edge_sum(), 3 * rows), std::span(other.edge_sum(), 3 * rows), "edge sums");
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

TEST(Neighbourhoods, LinksAreConsistent) {
    const Parallel parallel(1);
    Specimen body = scattered(300, 4, parallel);
    fixtures::cut_randomly(body, 3, 0.1, 5, parallel);
    const Neighbourhoods& links = body.neighbourhoods;
    for (std::uint32_t i = 0; i < links.size(); ++i)
        for (std::uint32_t l = links.offsets()[i]; l < links.offsets()[i + 1]; ++l) {
            const std::uint32_t j = links.neighbour()[l];
            EXPECT_EQ(links.rest_edge()[l], body.phyxels.rest_position[j] - body.phyxels.rest_position[i]);
            if (l > links.offsets()[i]) {
                EXPECT_LT(links.neighbour()[l - 1], j);
            }
            bool found = false;
            for (std::uint32_t back = links.offsets()[j]; back < links.offsets()[j + 1]; ++back) {
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
