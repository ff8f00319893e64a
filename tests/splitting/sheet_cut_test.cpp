// Sheet cuts through solids: the resulting pieces fit together.
#include <splitcubes/splitting/sheet_cut.h>

#include "laws/solids.h"

#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/solidify.h>
#include <splitcubes/splitting/validate.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

namespace splitcubes::splitting {
namespace {

using namespace laws;
using geometry::TriangleMesh;

NodeGrid closed_grid(const TriangleMesh& mesh, int cells) {
    static const Parallel parallel(2);
    SolidifyReport report;
    const double cell_size = geometry::cell_size_for(mesh.bounds(), cells);
    return solidify(mesh, geometry::grid_around(mesh.bounds(), cell_size), report, parallel);
}

using Position = std::array<double, 3>;
using Corners = std::array<Position, 3>;

// Returns the triangle's vertex positions, rotated to begin with the smallest one.
Corners positions_of(const TriangleMesh& mesh, const geometry::Triangle& t) {
    Corners out;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& p = mesh.positions[t[k]];
        out[k] = {p[0] + 0.0, p[1] + 0.0, p[2] + 0.0};
    }
    std::rotate(out.begin(), std::min_element(out.begin(), out.end()), out.end());
    return out;
}

Corners reversed_corners(Corners corners) {
    std::swap(corners[1], corners[2]);
    return corners;
}

// Checks that every triangle of a cut face has a partner on the other side at the same positions, to the last
// bit.
void expect_sides_to_coincide(const geometry::SurfaceMesh& surface) {
    std::multiset<Corners> sides;
    std::vector<Corners> all;
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
        if (surface.triangle_origin[t] != Origin::cut) continue;
        all.push_back(positions_of(surface.mesh, surface.mesh.triangles[t]));
        sides.insert(all.back());
    }
    ASSERT_FALSE(all.empty());
    for (const Corners& corners : all)
        ASSERT_EQ(sides.count(corners), sides.count(reversed_corners(corners)));
}

struct ConvexBody {
    const char* name;
    TriangleMesh mesh;
};

std::vector<ConvexBody> convex_bodies() {
    return {{"box", geometry::make_box(Vec3(1, 0.8, 0.7))},
            {"sphere", geometry::make_sphere(0.5, 5)},
            {"capsule", geometry::make_capsule(0.3, 0.4, 64)}};
}

TEST(SheetCut, APlaneMakesTwoOfAConvexBody) {
    Random random(1);
    for (const ConvexBody& body : convex_bodies()) {
        const NodeGrid uncut = closed_grid(body.mesh, 48);
        const Surface boundary(uncut);
        const double whole = extract(uncut, boundary, Pieces(uncut)).mesh.volume();
        for (int trial = 0; trial < 6; ++trial) {
            const Vec3 normal = random_direction(random);
            const Vec3 center = random_vector(random, 0.1);
            SCOPED_TRACE(testing::Message() << body.name << ", trial " << trial << ", plane through "
                                            << center.transpose() << " across " << normal.transpose());
            NodeGrid grid = uncut;
            Surface surface = boundary;
            const TriangleMesh sheet = geometry::make_plane_sheet(center, normal, 2, 3);
            const std::vector<std::int32_t> slots = cut_with_sheet(grid, sheet, 4);
            ASSERT_FALSE(slots.empty());
            for (const std::int32_t slot : slots) {
                const Crossing& c = grid.crossing(slot);
                ASSERT_EQ(c.cut, 4);
                ASSERT_EQ(c.origin, Origin::cut);
                ASSERT_NEAR(std::abs(c.normal.dot(normal)), 1, 1e-9);
            }
            surface.retessellate(grid, slots);
            const Pieces pieces(grid);
            ASSERT_EQ(validate(grid), std::vector<std::string>{});
            ASSERT_EQ(validate(grid, surface, pieces), std::vector<std::string>{});
            const geometry::SurfaceMesh mesh = extract(grid, surface, pieces);
            ASSERT_EQ(pieces.count(), 2U);
            double sum = 0;
            for (std::int32_t piece = 0; piece < 2; ++piece) {
                const geometry::SurfaceMesh part = extract_piece(mesh, piece);
                ASSERT_TRUE(geometry::check_mesh(part.mesh).valid());
                ASSERT_GT(part.mesh.volume(), 0.05 * whole);
                sum += part.mesh.volume();
            }
            EXPECT_NEAR(sum, mesh.mesh.volume(), 1e-9 * sum);
            EXPECT_NEAR(sum, whole, 1e-3 * whole);
            expect_sides_to_coincide(mesh);
            // Below the boundary the cut is the plane; crossings keep min_parameter from nodes.
            for (const SurfaceCell& cell : surface.cells()) {
                if (cell.inside != 255) continue;
                for (const SurfaceQuad& quad : surface.quads(cell))
                    for (const std::uint32_t v : quad.vertices)
                        ASSERT_LT(std::abs(normal.dot(surface.vertices()[v].rest - center)),
                                  1.5 * min_parameter * grid.rest().cell_size);
            }
            // Every node is on its piece's side of the plane.
            const Vec3i n = grid.rest().node_count;
            std::array<int, 2> side{0, 0};
            for (int k = 0; k < n.prod(); ++k) {
                const Vec3i node(k % n[0], k / n[0] % n[1], k / (n[0] * n[1]));
                const double height = normal.dot(grid.rest().node_position(node) - center);
                if (!grid.inside(node) || std::abs(height) < 1e-6) continue;
                int& known = side[static_cast<std::size_t>(pieces.piece_of(grid, node))];
                if (known == 0) known = height > 0 ? 1 : -1;
                ASSERT_EQ(known, height > 0 ? 1 : -1);
            }
            EXPECT_EQ(side[0] * side[1], -1);
        }
    }
}

TEST(SheetCut, TheSameSheetAgainChangesNothing) {
    Random random(2);
    for (const ConvexBody& body : convex_bodies()) {
        NodeGrid grid = closed_grid(body.mesh, 24);
        const TriangleMesh sheet =
            geometry::make_wavy_sheet(Vec3::Zero(), random_direction(random), 1, 40, 0.05, 0.4);
        const auto slots = cut_with_sheet(grid, sheet, 0);
        EXPECT_FALSE(slots.empty());
        Surface surface(grid);
        const auto before = canonical_quads(surface);
        EXPECT_TRUE(cut_with_sheet(grid, sheet, 1).empty());
        EXPECT_TRUE(cut_with_sheet(grid, reversed(sheet), 2).empty());
        EXPECT_TRUE(surface.retessellate(grid, {}).empty());
        EXPECT_EQ(canonical_quads(surface), before);
        EXPECT_EQ(canonical_quads(Surface(grid)), before);
    }
}

TEST(SheetCut, OrderOfTwoSheetsDoesNotMatter) {
    Random random(3);
    for (const ConvexBody& body : convex_bodies()) {
        for (int trial = 0; trial < 5; ++trial) {
            // The sheets are so far apart that no edge meets both; on an edge that did, the first hit would
            // win.
            const NodeGrid uncut = closed_grid(body.mesh, 24);
            const Vec3 normal = random_direction(random);
            const double apart = 2 * uncut.rest().cell_size;
            const TriangleMesh a = geometry::make_plane_sheet(-apart * normal, normal, 2);
            const TriangleMesh b = geometry::make_wavy_sheet(apart * normal, normal, 2, 60, 0.01, 0.5);
            const auto cut = [&](const TriangleMesh& first, const TriangleMesh& second) {
                NodeGrid grid = uncut;
                Surface surface(grid);
                surface.retessellate(grid, cut_with_sheet(grid, first, 0));
                surface.retessellate(grid, cut_with_sheet(grid, second, 1));
                EXPECT_EQ(Pieces(grid).count(), 3U) << body.name << ", trial " << trial;
                return canonical_quads(surface);
            };
            ASSERT_EQ(cut(a, b), cut(b, a)) << body.name << ", trial " << trial;
        }
    }
}

TEST(SheetCut, OrderOfCrossingSheetsLeavesTheSamePieces) {
    Random random(4);
    for (int trial = 0; trial < 5; ++trial) {
        const NodeGrid uncut = closed_grid(geometry::make_sphere(0.5, 4), 24);
        const TriangleMesh a = geometry::make_plane_sheet(Vec3::Zero(), random_direction(random), 2);
        const TriangleMesh b = geometry::make_plane_sheet(Vec3::Zero(), random_direction(random), 2);
        const auto cut = [&](const TriangleMesh& first, const TriangleMesh& second) {
            NodeGrid grid = uncut;
            cut_with_sheet(grid, first, 0);
            cut_with_sheet(grid, second, 1);
            std::set<std::uint64_t> edges;
            for (const Crossing& c : grid.crossings()) edges.insert(edge_id(c.edge));
            EXPECT_GE(Pieces(grid).count(), 4U);
            return edges;
        };
        ASSERT_EQ(cut(a, b), cut(b, a));
    }
}

TEST(SheetCut, AClosedMeshCutsOutItsInside) {
    NodeGrid grid = closed_grid(geometry::make_box(Vec3::Ones()), 32);
    const TriangleMesh core = geometry::make_sphere(0.3, 4);
    EXPECT_FALSE(cut_with_sheet(grid, core, 0).empty());
    const Surface surface(grid);
    const Pieces pieces(grid);
    ASSERT_EQ(pieces.count(), 2U);
    EXPECT_EQ(validate(grid, surface, pieces), std::vector<std::string>{});
    const auto measures = measure_pieces(extract(grid, surface, pieces), 2);
    const double ball = std::min(measures[0].volume, measures[1].volume);
    EXPECT_NEAR(ball, core.volume(), 0.01 * core.volume());
    EXPECT_NEAR(measures[0].volume + measures[1].volume, 1, 1e-2);
    EXPECT_NEAR(measures[0].cut_area, measures[1].cut_area, 1e-12);
}

TEST(SheetCut, ASheetThatEndsInsideLeavesOnePiece) {
    NodeGrid grid = closed_grid(geometry::make_box(Vec3::Ones()), 24);
    const double whole = extract(grid, Surface(grid), Pieces(grid)).mesh.volume();
    EXPECT_FALSE(
        cut_with_sheet(grid, geometry::make_plane_sheet(Vec3::Zero(), Vec3(0.1, 0.2, 1), 0.3), 0).empty());
    const Surface surface(grid);
    const Pieces pieces(grid);
    EXPECT_EQ(pieces.count(), 1U);
    EXPECT_EQ(validate(grid, surface, pieces), std::vector<std::string>{});
    const geometry::SurfaceMesh mesh = extract(grid, surface, pieces);
    EXPECT_NEAR(mesh.mesh.volume(), whole, 1e-9 * whole) << "a slit has no volume";
    expect_sides_to_coincide(mesh);
}

TEST(SheetCut, ASheetOutsideCutsNothing) {
    NodeGrid grid = closed_grid(geometry::make_sphere(0.5, 3), 16);
    const std::size_t before = grid.crossings().size();
    EXPECT_TRUE(
        cut_with_sheet(grid, geometry::make_plane_sheet(Vec3(0, 0, 0.6), Vec3::UnitZ(), 2), 0).empty());
    EXPECT_TRUE(cut_with_sheet(grid, {}, 0).empty());
    EXPECT_EQ(grid.crossings().size(), before);
}

TEST(SheetCut, RefusesASheetThatIsNotFinite) {
    NodeGrid grid = closed_grid(geometry::make_sphere(0.5, 3), 16);
    TriangleMesh sheet = geometry::make_plane_sheet(Vec3::Zero(), Vec3::UnitZ(), 2);
    sheet.positions[0][0] = std::numeric_limits<double>::infinity();
    EXPECT_THROW(cut_with_sheet(grid, sheet, 0), InputError);
    sheet = geometry::make_plane_sheet(Vec3::Zero(), Vec3::UnitZ(), 2);
    sheet.triangles[0][2] = 99;
    EXPECT_THROW(cut_with_sheet(grid, sheet, 0), InputError);
}

}  // namespace
}  // namespace splitcubes::splitting
