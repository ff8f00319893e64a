// The volumes of the pieces sum to the total: exactly to that of the cut surface, and to that of the uncut
// body except in the cells in which a cut meets the boundary.
#include "laws/solids.h"

#include <gtest/gtest.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/solidify.h>
#include <splitcubes/splitting/validate.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace splitcubes::splitting {
namespace {

using namespace laws;
using geometry::TriangleMesh;

// A cut moves only face and centre vertices of cells in which it meets the boundary. The change is at most
// this share of such a cell's volume, averaged over a cut's cells; the test records the largest share found.
constexpr double max_share_of_boundary_cells = 0.02;

std::size_t cells_with_both(const NodeGrid& grid, const Surface& surface) {
    std::size_t count = 0;
    for (const SurfaceCell& cell : surface.cells()) {
        bool boundary = false, cut = false;
        for (int e = 0; e < edge_count; ++e) {
            if (!(cell.mask >> e & 1)) continue;
            const Origin origin = grid.crossing(grid.slot(cell_edge(cell.lowest_node, e))).origin;
            (origin == Origin::boundary ? boundary : cut) = true;
        }
        count += boundary && cut;
    }
    return count;
}

TriangleMesh random_body(Random& random, int kind) {
    if (kind == 0) return geometry::make_sphere(random.uniform(0.4, 0.5), 4);
    if (kind == 1) {
        const double tube = random.uniform(0.1, 0.16);
        return turned(geometry::make_torus(0.35, tube, 64, 32), random_rotation(random));
    }
    const double depth = random.uniform(0.5, 1);
    const Vec3 size(1, depth, random.uniform(0.4, 0.8));
    return turned(geometry::make_box(size), random_rotation(random));
}

TriangleMesh random_sheet(Random& random) {
    const Vec3 center = random_vector(random, 0.25), normal = random_direction(random);
    if (random.below(2) == 0) return geometry::make_plane_sheet(center, normal, 2, 2);
    const double wavelength = random.uniform(0.3, 0.8);
    return geometry::make_wavy_sheet(center, normal, 1.2, 60, wavelength * random.uniform(0.02, 0.12),
                                     wavelength);
}

// Cuts a random body with up to `max_sheets` sheets and checks the volumes after each.
void check_volumes(int trials, int max_sheets, int cells, std::uint64_t seed) {
    const Parallel parallel(2);
    Random random(seed);
    double largest_share = 0, largest_change = 0;
    for (int trial = 0; trial < trials; ++trial) {
        SCOPED_TRACE("trial " + std::to_string(trial));
        const TriangleMesh body = random_body(random, trial % 3);
        SolidifyReport report;
        const double h = geometry::cell_size_for(body.bounds(), cells);
        NodeGrid grid = solidify(body, geometry::grid_around(body.bounds(), h), report, parallel);
        Surface surface(grid);
        const double uncut = extract(grid, surface, Pieces(grid)).mesh.volume();
        const int sheets = 1 + static_cast<int>(random.below(static_cast<std::uint32_t>(max_sheets)));
        for (int k = 0; k < sheets; ++k) {
            surface.retessellate(grid, cut_with_sheet(grid, random_sheet(random), k));
            const Pieces pieces(grid);
            const geometry::SurfaceMesh mesh = extract(grid, surface, pieces);
            const std::vector<PieceMeasure> measures = measure_pieces(mesh, pieces.count());
            double sum = 0;
            std::size_t triangles = 0;
            for (const PieceMeasure& m : measures) {
                sum += m.volume;
                triangles += m.triangles;
            }
            ASSERT_EQ(triangles, mesh.mesh.triangles.size());
            ASSERT_NEAR(sum, mesh.mesh.volume(), 1e-12 * uncut);
            const double boundary_volume = static_cast<double>(cells_with_both(grid, surface)) * h * h * h;
            ASSERT_LE(std::abs(sum - uncut), max_share_of_boundary_cells * boundary_volume)
                << sheets << " sheets, at " << k;
            if (boundary_volume > 0)
                largest_share = std::max(largest_share, std::abs(sum - uncut) / boundary_volume);
            largest_change = std::max(largest_change, std::abs(sum / uncut - 1));
        }
        // Each piece alone, as a separate mesh.
        const Pieces pieces(grid);
        const geometry::SurfaceMesh mesh = extract(grid, surface, pieces);
        double sum = 0;
        for (std::int32_t piece = 0; piece < static_cast<std::int32_t>(pieces.count()); ++piece) {
            const TriangleMesh part = extract_piece(mesh, piece).mesh;
            ASSERT_TRUE(geometry::check_mesh(part).valid());
            sum += part.volume();
        }
        ASSERT_NEAR(sum, mesh.mesh.volume(), 1e-12 * uncut);
    }
    testing::Test::RecordProperty("largest_share_of_boundary_cells", std::to_string(largest_share));
    testing::Test::RecordProperty("largest_relative_change", std::to_string(largest_change));
}

TEST(Volumes, OfThePiecesSumToTheWhole) {
    check_volumes(36, 12, 32, 61);
}

TEST(Volumes, OfFewPiecesSumToTheWhole) {
    check_volumes(6, 3, 16, 62);
}

}  // namespace
}  // namespace splitcubes::splitting
