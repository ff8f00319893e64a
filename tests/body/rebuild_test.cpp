// After any cuts, what stages updated equals what would be computed anew.
#include <splitcubes/body/body.h>

#include "laws/solids.h"
#include "laws/worlds.h"

#include <gtest/gtest.h>
#include <splitcubes/node_motion/node_tracker.h>
#include <splitcubes/samples/kernel.h>

#include <utility>
#include <vector>

namespace splitcubes::body {
namespace {

using namespace laws;

// A square across a direction.
geometry::TriangleMesh square(const Vec3& centre, const Vec3& normal, double side) {
    const Vec3 u = 0.5 * side * normal.unitOrthogonal(), v = normal.cross(u);
    return {{centre - u - v, centre + u - v, centre + u + v, centre - u + v}, {{0, 1, 2}, {0, 2, 3}}};
}

void expect_rebuilt_links(const Body& body, const Parallel& parallel) {
    const meshless::Neighbourhoods& links = body.neighbourhoods();
    meshless::Neighbourhoods fresh;
    fresh.rebuild(body.phyxels(), body.pairs(), body.settings().material, parallel);
    ASSERT_EQ(links.size(), fresh.size());
    for (std::size_t i = 0; i < links.size(); ++i) {
        ASSERT_EQ(links.rank()[i], fresh.rank()[i]) << i;
        ASSERT_EQ(links.moment()[i], fresh.moment()[i]) << i;
        ASSERT_EQ(links.penalty()[i], fresh.penalty()[i]) << i;
        ASSERT_EQ(links.stiffness_diagonal()[i], fresh.stiffness_diagonal()[i]) << i;
        const std::size_t count = links.links_end(i) - links.links_begin(i);
        ASSERT_EQ(count, fresh.links_end(i) - fresh.links_begin(i)) << i;
        for (std::size_t k = 0; k < count; ++k) {
            const std::size_t one = links.links_begin(i) + k, other = fresh.links_begin(i) + k;
            ASSERT_EQ(links.neighbour()[one], fresh.neighbour()[other]) << i;
            ASSERT_EQ(links.gradient()[one], fresh.gradient()[other]) << i;
            ASSERT_EQ(links.reverse_gradient()[one], fresh.reverse_gradient()[other]) << i;
            ASSERT_EQ(links.weight()[one], fresh.weight()[other]) << i;
        }
    }
}

void expect_rebuilt_kernels(const Body& body) {
    const NodeTracker& nodes = body.nodes();
    const meshless::Phyxels& phyxels = body.phyxels();
    for (std::uint32_t n = 0; n < nodes.size(); ++n) {
        if (!nodes.is_awake(n)) continue;
        const Vec3& rest = nodes.rest_positions()[n];
        const std::int32_t piece = body.pieces().piece_of(body.grid(), nodes.nodes()[n]);
        std::vector<std::pair<std::uint32_t, double>> wanted, found;
        double total = 0;
        for (std::uint32_t i = 0; i < phyxels.size(); ++i) {
            const double weight =
                meshless::kernel((phyxels.rest_position[i] - rest).squaredNorm(), phyxels.support_radius[i]);
            if (!(weight > 0) || phyxels.piece[i] != piece ||
                body.occluders().segment_blocked(rest, phyxels.rest_position[i]))
                continue;
            wanted.emplace_back(i, weight);
            total += weight;
        }
        if (wanted.empty()) continue;  // it takes the frame of another node, or follows the nearest phyxel
        for (auto& [phyxel, weight] : wanted) weight /= total;
        const meshless::NodeKernels::Row& row = nodes.kernels().rows[n];
        for (std::uint32_t k = row.begin; k < row.begin + row.count; ++k)
            found.emplace_back(nodes.kernels().phyxel[k], nodes.kernels().weight[k]);
        ASSERT_EQ(found, wanted) << "node " << n;
    }
}

TEST(Rebuild, RowsOfLinksAndNodesFollowAnyCuts) {
    const Parallel parallel(2);
    for (const std::uint64_t seed : {1, 2, 3}) {
        Random random(seed);
        Body body(geometry::make_box(Vec3(0.2, 0.16, 0.14)), soft(0.2 / 14, 300), parallel);
        const std::size_t phyxels = body.phyxels().size();
        for (int cut = 0; cut < 14; ++cut) {
            body.cut_with_sheet(
                square(random_vector(random, 0.05), random_direction(random), random.uniform(0.1, 0.4)), cut,
                parallel);
            expect_rebuilt_links(body, parallel);
            expect_rebuilt_kernels(body);
            if (testing::Test::HasFatalFailure()) return;
            ASSERT_EQ(body.validate(), std::vector<std::string>{});
        }
        EXPECT_GT(body.pieces().count(), 5U);
        EXPECT_GT(body.phyxels().size(), phyxels) << "fragments got phyxels";
    }
}

}  // namespace
}  // namespace splitcubes::body
