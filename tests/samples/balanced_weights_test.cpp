#include <splitcubes/samples/balanced_weights.h>
#include <splitcubes/samples/tuning.h>

#include "dynamics/bodies.h"

#include <gtest/gtest.h>

namespace splitcubes::meshless {
namespace {

using fixtures::block;
using fixtures::random_vector;
using fixtures::Specimen;

struct Links {
    std::vector<Vec3> edge;
    std::vector<double> weight;

    // Returns the sum of squares of the third moments.
    double third_moments() const {
        double sum = 0;
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) {
                Vec3 moments = Vec3::Zero();
                for (std::size_t j = 0; j < edge.size(); ++j)
                    moments += weight[j] * edge[j][a] * edge[j][b] * edge[j];
                sum += moments.squaredNorm();
            }
        return sum;
    }
};

Links one_sided(int count, Random& random) {
    Links links;
    for (int k = 0; k < count; ++k) {
        links.edge.push_back(random_vector(random, 1) + Vec3(0.3, 0.2, 0));
        links.weight.push_back(random.uniform(0.1, 1));
    }
    return links;
}

TEST(BalancedWeights, HaveSmallerThirdMomentsAndStayAboveTheFloor) {
    Random random(1);
    for (int trial = 0; trial < 200; ++trial) {
        const Links before = one_sided(1 + trial % static_cast<int>(max_balanced_links), random);
        Links after = before;
        balance_weights(after.edge, after.weight, 1);
        EXPECT_LT(after.third_moments(), before.third_moments());
        for (std::size_t j = 0; j < after.weight.size(); ++j)
            EXPECT_GT(after.weight[j], 0.999 * tuning::balance::floor * before.weight[j]);
    }
}

TEST(BalancedWeights, DoNotDependOnUnits) {
    Random random(2);
    for (int trial = 0; trial < 50; ++trial) {
        Links links = one_sided(5 + trial % 20, random), scaled = links;
        const double length = std::pow(10, random.uniform(-4, 4)), unit = std::pow(10, random.uniform(-6, 6));
        for (Vec3& edge : scaled.edge) edge *= length;
        for (double& weight : scaled.weight) weight *= unit;
        balance_weights(links.edge, links.weight, 1);
        balance_weights(scaled.edge, scaled.weight, length);
        for (std::size_t j = 0; j < links.weight.size(); ++j)
            EXPECT_NEAR(scaled.weight[j] / unit, links.weight[j], 1e-9 * links.weight[j]);
    }
}

TEST(BalancedWeights, OfSymmetricLinksAreTheirWeights) {
    Random random(3);
    for (int trial = 0; trial < 50; ++trial) {
        Links links = one_sided(8, random);
        for (std::size_t j = 0; j < 8; ++j) {
            links.edge.emplace_back(-links.edge[j]);
            links.weight.push_back(links.weight[j]);
        }
        const std::vector<double> before = links.weight;
        balance_weights(links.edge, links.weight, 1);
        EXPECT_EQ(links.weight, before);
    }
}

// Gradients, whatever the cuts and the sampling: exact for linear fields where the rank is full.
TEST(BalancedWeights, KeepLinearFieldsExact) {
    const Parallel parallel(1);
    for (const bool is_scattered : {false, true}) {
        Specimen body;
        if (is_scattered) {
            Random random(4);
            for (int i = 0; i < 400; ++i) body.add(random_vector(random, 0.2), 0.05);
            body.connect(parallel);
        } else {
            body = block(8, 7, 6, 0.05, Material{}, parallel);
        }
        fixtures::cut_randomly(body, 6, 0.1, 2, parallel);
        const Neighbourhoods& links = body.neighbourhoods;
        std::size_t full = 0;
        for (std::size_t i = 0; i < links.size(); ++i) {
            if (links.rank()[i] < 3) continue;
            ++full;
            Mat3 sum = Mat3::Zero();
            for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l)
                sum += links.rest_edge()[l] * links.gradient()[l].transpose();
            EXPECT_LT((sum - Mat3::Identity()).norm(), 1e-9);
        }
        EXPECT_GT(full, links.size() / 2);
    }
}

// Returns the share of the strain energy of pure bending that the gradients of a bar see.
double bending_seen(int across) {
    const Parallel parallel(1);
    const Specimen body = block(15, across, across, 1, Material{}, parallel);
    const Neighbourhoods& links = body.neighbourhoods;
    double seen = 0, exact = 0;
    for (std::size_t i = 0; i < links.size(); ++i) {
        const Vec3& X = body.phyxels.rest_position[i];
        if (std::abs(X.x()) > 4) continue;
        double strain = 0;
        for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l) {
            const Vec3 Y = X + links.rest_edge()[l];
            strain += (Y.x() * Y.z() - X.x() * X.z()) * links.gradient()[l].x();
        }
        seen += strain * strain;
        exact += across * across / 12.0;
    }
    return seen / exact;
}

// Nodal quadrature of exact strains sees 1 - 1 / across^2; weights that are not balanced see 0.6 and 0.76.
TEST(BalancedWeights, SeeTheBendingOfThinBars) {
    for (const int across : {3, 4, 6}) {
        const double limit = 1 - 1.0 / (across * across);
        EXPECT_GT(bending_seen(across), 0.95 * limit) << across;
        EXPECT_LT(bending_seen(across), 1.02 * limit) << across;
    }
}

}  // namespace
}  // namespace splitcubes::meshless
