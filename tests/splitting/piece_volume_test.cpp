// The volume at rest of every piece is positive, however sheets meet.
#include "laws/solids.h"
#include "splitting/cut_case.h"

#include <gtest/gtest.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/solidify.h>
#include <splitcubes/splitting/validate.h>

#include <algorithm>
#include <string>
#include <utility>

namespace splitcubes::splitting {
namespace {

using namespace laws;
using geometry::TriangleMesh;

// Volumes of the pieces, in cells.
std::vector<double> volumes_of(const NodeGrid& grid, const Surface& surface) {
    const Pieces pieces(grid);
    std::vector<double> out;
    for (const PieceMeasure& m : measure_pieces(extract(grid, surface, pieces), pieces.count()))
        out.push_back(m.volume / std::pow(grid.rest().cell_size, 3));
    return out;
}

TriangleMesh sheet_through(Random& random, const Vec3& centre) {
    const double wavelength = random.uniform(0.2, 0.8);
    switch (random.below(3)) {
        case 0:
            return geometry::make_plane_sheet(centre, random_direction(random), 2, 1);
        case 1:
            return geometry::make_plane_sheet(centre, random_direction(random), random.uniform(0.1, 0.6), 1);
        default:
            return geometry::make_wavy_sheet(centre, random_direction(random), random.uniform(0.4, 1.2), 40,
                                             wavelength * random.uniform(0.02, 0.3), wavelength);
    }
}

struct CutBody {
    NodeGrid grid;
    Surface surface;
};

// Cuts a body of 16 cells with 30 random sheets.
CutBody cut_body(Random& random, const TriangleMesh& body, const Parallel& parallel) {
    SolidifyReport report;
    const double h = geometry::cell_size_for(body.bounds(), 16);
    NodeGrid grid = solidify(body, geometry::grid_around(body.bounds(), h), report, parallel);
    Surface surface(grid);
    for (int k = 0; k < 30; ++k)
        surface.retessellate(grid,
                             cut_with_sheet(grid, sheet_through(random, random_vector(random, 0.3)), k));
    return {std::move(grid), std::move(surface)};
}

TEST(PieceVolumes, ArePositiveWhereRandomSheetsMeet) {
    const Parallel parallel(2);
    Random random(71);
    double lowest = 1;
    for (int trial = 0; trial < 12; ++trial) {
        SCOPED_TRACE("trial " + std::to_string(trial));
        const TriangleMesh body =
            turned(geometry::make_box({1, random.uniform(0.3, 1), random.uniform(0.1, 0.8)}),
                   random_rotation(random));
        const auto [grid, surface] = cut_body(random, body, parallel);
        for (const double volume : volumes_of(grid, surface)) {
            EXPECT_GT(volume, 0);
            lowest = std::min(lowest, volume);
        }
    }
    RecordProperty("lowest_in_cells", std::to_string(lowest));
}

// Returns how far a point is outside a box around the origin, m; in the frame of the box.
double outside_box(const Vec3& point, const Vec3& size) {
    return (point.cwiseAbs() - 0.5 * size).cwiseMax(0).norm();
}

TEST(PieceVolumes, CutsStayWithinTheSolid) {
    const Parallel parallel(2);
    Random random(73);
    double farthest = 0;
    for (int trial = 0; trial < 12; ++trial) {
        const Vec3 size(1, random.uniform(0.3, 1), random.uniform(0.1, 0.8));
        const Quat rotation = random_rotation(random);
        const TriangleMesh body = turned(geometry::make_box(size), rotation);
        const auto [grid, surface] = cut_body(random, body, parallel);
        for (const SurfaceCell& cell : surface.cells())
            for (const SurfaceQuad& quad : surface.quads(cell))
                for (const std::uint32_t vertex : quad.vertices) {
                    const double out =
                        outside_box(rotation.conjugate() * surface.vertices()[vertex].rest, size) /
                        grid.rest().cell_size;
                    farthest = std::max(farthest, out);
                }
    }
    RecordProperty("farthest_in_cells", std::to_string(farthest));
    // The grid does not know an edge of the solid that passes between the crossings around a cell.
    EXPECT_LT(farthest, 0.5);
}

TEST(PieceVolumes, ArePositiveForAnyCrossings) {
    Random random(72);
    for (int trial = 0; trial < 3000; ++trial) {
        cases::CutCase c;
        c.node_count = Vec3i::Constant(4 + static_cast<int>(random.below(2)));
        const auto share = random.uniform(0.2, 1);
        for (int z = 0; z < c.node_count[2]; ++z)
            for (int y = 0; y < c.node_count[1]; ++y)
                for (int x = 0; x < c.node_count[0]; ++x)
                    if (random.uniform(0, 1) < share) c.inside.push_back({x, y, z});
        NodeGrid empty = cases::uncut_grid(c);
        const double cut = random.uniform(0, 1);
        cases::for_each_edge(empty, [&](const GridEdge& edge) {
            const bool boundary = empty.inside(edge.node) != empty.inside(edge.upper());
            if (boundary || random.uniform(0, 1) < cut)
                c.cuts.push_back({edge, random.uniform(0, 1), random_direction(random),
                                  boundary ? -1 : static_cast<std::int32_t>(random.below(3))});
        });
        const NodeGrid grid = cases::grid_of(c);
        for (const double volume : volumes_of(grid, Surface(grid))) ASSERT_GT(volume, 0) << trial;
    }
}

}  // namespace
}  // namespace splitcubes::splitting
