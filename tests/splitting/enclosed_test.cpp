// A piece is inside or outside a closed mesh that cut it, never on both sides.
#include <splitcubes/splitting/enclosed.h>

#include "laws/solids.h"

#include <gtest/gtest.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/geometry/winding_number.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/solidify.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace splitcubes::splitting {
namespace {

using namespace laws;
using geometry::TriangleMesh;

NodeGrid solidified(const TriangleMesh& mesh, int cells) {
    static const Parallel parallel(2);
    SolidifyReport report;
    return solidify(mesh, geometry::grid_around(mesh.bounds(), geometry::cell_size_for(mesh.bounds(), cells)),
                    report, parallel);
}

std::size_t count(const std::vector<Enclosure>& where, Enclosure wanted) {
    return static_cast<std::size_t>(std::count(where.begin(), where.end(), wanted));
}

// Returns a closed mesh that intersects itself: a band pulled through itself.
TriangleMesh crossed(const TriangleMesh& mesh, double twist) {
    TriangleMesh out = mesh;
    for (Vec3& p : out.positions) {
        const double angle = twist * p[2];
        p[0] += 0.3 * std::sin(3 * angle);
        p[1] *= std::cos(2 * angle);  // changes sign: parts are inside out
    }
    return out;
}

TriangleMesh some_cutter(Random& random, int kind) {
    const double size = std::pow(10, random.uniform(-1.3, 0.3));
    TriangleMesh mesh = kind == 0   ? geometry::make_sphere(1, 3)
                        : kind == 1 ? geometry::make_torus(1, 0.4, 24, 12)
                        : kind == 2 ? crossed(geometry::make_torus(1, 0.5, 40, 20), 2)
                                    : joined(geometry::make_box(Vec3(1, 2, 0.7)),
                                             reversed(moved(geometry::make_sphere(0.8, 2), Vec3(0.3, 0, 0))));
    return moved(turned(scaled(mesh, size), random_rotation(random)), random_vector(random, 0.5));
}

TEST(Enclosed, NoPieceIsPartlyInsideItsCutter) {
    Random random(5);
    std::size_t inside = 0;
    for (int trial = 0; trial < 14; ++trial) {
        NodeGrid grid = solidified(geometry::make_box(Vec3(1, 0.9, 0.8)), 20);
        std::vector<TriangleMesh> cutters;
        for (int k = 0; k < 4; ++k) {
            // Open sheets and other cutters cut edges before and after.
            const TriangleMesh open = geometry::make_wavy_sheet(random_vector(random, 0.4),
                                                                random_direction(random), 0.6, 10, 0.05, 0.5);
            cut_with_sheet(grid, open, 100 + k);
            cutters.push_back(some_cutter(random, k));
            cut_with_sheet(grid, cutters.back(), k);
        }
        const Pieces pieces(grid);
        for (std::size_t k = 0; k < cutters.size(); ++k) {
            const auto where = enclosure_of_pieces(grid, pieces, cutters[k]);
            ASSERT_EQ(where.size(), pieces.count());
            ASSERT_EQ(count(where, Enclosure::both), 0U) << "trial " << trial << ", cutter " << k;
            inside += count(where, Enclosure::inside);
        }
    }
    EXPECT_GT(inside, 60U);
}

TEST(Enclosed, AgreesWithTheSolidAngleAtEveryNode) {
    Random random(6);
    for (int trial = 0; trial < 4; ++trial) {
        NodeGrid grid = solidified(geometry::make_sphere(0.5, 3), 16);
        const TriangleMesh cutter = some_cutter(random, trial % 4);
        cut_with_sheet(grid, cutter, 0);
        const Pieces pieces(grid);
        const auto where = enclosure_of_pieces(grid, pieces, cutter);
        const geometry::WindingNumber winding(cutter);
        const Vec3i n = grid.rest().node_count;
        for (int k = 0; k < n.prod(); ++k) {
            const Vec3i node(k % n[0], k / n[0] % n[1], k / (n[0] * n[1]));
            const double angle = winding.exact_at(grid.rest().node_position(node));
            if (!grid.inside(node) || std::abs(angle - std::round(angle)) > 1e-5) continue;
            const auto piece = static_cast<std::size_t>(pieces.piece_of(grid, node));
            ASSERT_EQ(where[piece], std::round(angle) == 0 ? Enclosure::outside : Enclosure::inside);
        }
    }
}

TEST(Enclosed, TellsWhereTheCutWasNotMade) {
    NodeGrid grid = solidified(geometry::make_box(Vec3::Ones()), 16);
    const TriangleMesh core = geometry::make_sphere(0.3, 3);
    EXPECT_EQ(enclosure_of_pieces(grid, Pieces(grid), core)[0], Enclosure::both);
    cut_with_sheet(grid, core, 0);
    const Pieces pieces(grid);
    ASSERT_EQ(pieces.count(), 2U);
    const auto where = enclosure_of_pieces(grid, pieces, core);
    EXPECT_EQ(count(where, Enclosure::inside), 1U);
    EXPECT_EQ(count(where, Enclosure::outside), 1U);
    EXPECT_EQ(enclosure_of_pieces(grid, pieces, reversed(core)), where);
}

TEST(Enclosed, MeasuresOfPiecesAreThoseOfTheirMeshes) {
    NodeGrid grid = solidified(geometry::make_box(Vec3(1, 0.8, 0.6)), 20);
    cut_with_sheet(grid, geometry::make_plane_sheet(Vec3(0.13, 0, 0), Vec3::UnitX(), 2), 0);
    const Surface surface(grid);
    const Pieces pieces(grid);
    ASSERT_EQ(pieces.count(), 2U);
    const geometry::SurfaceMesh whole = extract(grid, surface, pieces);
    const auto measures = measure_pieces(whole, 2);
    for (std::int32_t k = 0; k < 2; ++k) {
        const geometry::SurfaceMesh part = extract_piece(whole, k);
        const PieceMeasure& m = measures[static_cast<std::size_t>(k)];
        EXPECT_NEAR(m.volume, part.mesh.volume(), 1e-14);
        EXPECT_EQ(m.bounds.min, part.mesh.bounds().min);
        EXPECT_EQ(m.bounds.max, part.mesh.bounds().max);
        // A box cut across: the part's middle, except for the corners that the grid cuts off.
        const double middle = m.bounds.center()[0] > 0.13 ? (0.5 + 0.13) / 2 : (-0.5 + 0.13) / 2;
        EXPECT_NEAR(m.center_of_mass[0], middle, 2e-3);
        EXPECT_NEAR(m.center_of_mass[1], 0, 1e-6);
        EXPECT_NEAR(m.center_of_mass[2], 0, 1e-6);
        const std::vector<std::uint8_t> wanted = {k == 0, k == 1};
        EXPECT_EQ(extract_pieces(whole, wanted).mesh.triangles, part.mesh.triangles);
    }
    EXPECT_EQ(extract_pieces(whole, std::vector<std::uint8_t>{1, 1}).mesh.positions, whole.mesh.positions);
    EXPECT_TRUE(extract_pieces(whole, std::vector<std::uint8_t>{0, 0}).mesh.positions.empty());
}

}  // namespace
}  // namespace splitcubes::splitting
