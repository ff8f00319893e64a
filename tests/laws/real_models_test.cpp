// Properties that hold for synthetic solids hold for real models, if these are available.
#include "laws/solids.h"
#include "laws/worlds.h"

#include <gtest/gtest.h>
#include <splitcubes/body/body.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/validate.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace splitcubes::laws {
namespace {

using geometry::TriangleMesh;
const std::vector<std::string> nothing_wrong;

std::optional<TriangleMesh> model(const std::string& name) {
    const std::filesystem::path file = std::filesystem::path(SPLITCUBES_MODELS) / (name + ".obj");
    if (!std::filesystem::exists(file)) return std::nullopt;
    return io::read_mesh(file);
}

class RealModels : public testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Laws, RealModels,
                         testing::Values("spot", "stanford-bunny", "fandisk", "cheburashka"),
                         [](const auto& model_name) {
                             std::string name = model_name.param;
                             std::erase(name, '-');
                             return name;
                         });

TEST_P(RealModels, HaveAValidSurfaceAtAnyResolution) {
    const std::optional<TriangleMesh> mesh = model(GetParam());
    if (!mesh) GTEST_SKIP() << GetParam() << " is not at hand";
    const bool closed = geometry::check_mesh(*mesh).closed();
    const Parallel parallel(0);
    for (const int cells : {16, 48, 128}) {
        SCOPED_TRACE(cells);
        const geometry::RestGrid rest =
            geometry::grid_around(mesh->bounds(), geometry::cell_size_for(mesh->bounds(), cells));
        splitting::SolidifyReport report;
        const splitting::NodeGrid grid = splitting::solidify(*mesh, rest, report, parallel);
        EXPECT_EQ(report.exact, closed);
        const splitting::Surface surface(grid);
        const splitting::Pieces pieces(grid);
        ASSERT_EQ(splitting::validate(grid), nothing_wrong);
        ASSERT_EQ(splitting::validate(grid, surface, pieces), nothing_wrong);
        const geometry::SurfaceMesh out = splitting::extract(grid, surface, pieces);
        EXPECT_TRUE(geometry::check_mesh(out.mesh).valid());
        if (!closed) continue;
        const double error = std::abs(out.mesh.volume() / mesh->volume() - 1);
        EXPECT_LT(error, cells == 128 ? 0.02 : 0.1);
        // No vertex is far from the model: a corner is at most a cell beside its cell.
        const geometry::Box box = mesh->bounds().grown(2 * rest.cell_size);
        for (const Vec3& p : out.mesh.positions) ASSERT_TRUE(box.contains(p));
    }
}

TEST_P(RealModels, FallApartUnderAPlane) {
    const std::optional<TriangleMesh> mesh = model(GetParam());
    if (!mesh) GTEST_SKIP() << GetParam() << " is not at hand";
    Random random(1);
    const Parallel parallel(0);
    const geometry::RestGrid rest =
        geometry::grid_around(mesh->bounds(), geometry::cell_size_for(mesh->bounds(), 48));
    splitting::SolidifyReport report;
    const splitting::NodeGrid uncut = splitting::solidify(*mesh, rest, report, parallel);
    const double whole =
        splitting::extract(uncut, splitting::Surface(uncut), splitting::Pieces(uncut)).mesh.volume();
    const std::size_t parts = splitting::Pieces(uncut).count();
    for (int trial = 0; trial < 3; ++trial) {
        splitting::NodeGrid grid = uncut;
        splitting::Surface surface(grid);
        const double size = mesh->bounds().size().norm();
        const TriangleMesh sheet =
            geometry::make_plane_sheet(mesh->bounds().center(), random_direction(random), size, 4);
        surface.retessellate(grid, splitting::cut_with_sheet(grid, sheet, 0));
        const splitting::Pieces pieces(grid);
        EXPECT_GT(pieces.count(), parts);
        ASSERT_EQ(splitting::validate(grid), nothing_wrong);
        ASSERT_EQ(splitting::validate(grid, surface, pieces), nothing_wrong);
        const geometry::SurfaceMesh out = splitting::extract(grid, surface, pieces);
        double sum = 0;
        for (const splitting::PieceMeasure& piece : splitting::measure_pieces(out, pieces.count()))
            sum += piece.volume;
        EXPECT_NEAR(sum, out.mesh.volume(), 1e-9 * whole);
        EXPECT_NEAR(sum, whole, 2e-3 * whole);
    }
}

TEST(RealModelsInMotion, OneBladeCutsSpotInTwo) {
    const std::optional<TriangleMesh> spot = model("spot");
    if (!spot) GTEST_SKIP() << "spot is not at hand";
    body::WorldSettings settings;
    const geometry::Box box = spot->bounds();
    const Vec3 size = box.size();
    // The model's height is along y, its length along z.
    settings.gravity = Vec3(0, -9.81, 0);
    settings.ground = meshless::GroundPlane{Vec3::UnitY(), box.min[1] - 0.02, 0.5};
    settings.validate_each_step = false;
    body::World world(settings, threads(0));
    body::BodySettings cow = soft(size.maxCoeff() / 28, 600);
    cow.name = "spot";
    cow.material.mass_damping = 0.5;
    cow.material.stiffness_damping = 0.002;
    body::Body& body = world.add_body(*spot, cow);
    const Vec3 middle = box.center();
    world.add_tool(moving_blade({-size[0], 0, 0}, {size[0], 0, 0.05},
                                {middle[0], box.max[1] + 0.1, middle[2]},
                                {middle[0], box.min[1] - 0.3, middle[2] + 0.1}, 0.05, 0.6, 2));
    const double mass = total_mass(body.phyxels());
    for (int frame = 0; frame < 60; ++frame) {
        const body::StepReport report = world.step();
        ASSERT_TRUE(std::isfinite(report.totals.kinetic_energy + report.totals.elastic_energy))
            << "frame " << frame;
        ASSERT_LT(report.totals.top_speed, 30) << "frame " << frame;
        ASSERT_NEAR(report.totals.mass, mass, 1e-12 * mass) << "frame " << frame;
        ASSERT_EQ(report.flags & body::flag_non_finite, 0U) << "frame " << frame;
        if (frame % 10 != 9) continue;
        ASSERT_EQ(body.validate(), nothing_wrong) << "frame " << frame;
    }
    // Two halves; the blade may also have cut off parts of ears, horns or feet.
    std::vector<double> shares = piece_shares(body.pieces());
    std::sort(shares.rbegin(), shares.rend());
    ASSERT_GE(shares.size(), 2U);
    EXPECT_GT(shares[1], 0.1);
    EXPECT_GT(shares[0] + shares[1], 0.95);
    const geometry::SurfaceMesh surface = world.surface_mesh();
    for (const Vec3& p : surface.mesh.positions) ASSERT_TRUE(p.allFinite());
    for (const Vec3& n : surface.normals) ASSERT_NEAR(n.norm(), 1, 1e-6);
    for (std::size_t piece = 0; piece < body.pieces().count(); ++piece) {
        const geometry::SurfaceMesh part =
            splitting::extract_piece(surface, static_cast<std::int32_t>(piece));
        EXPECT_TRUE(geometry::check_mesh(part.mesh).valid()) << "piece " << piece;
    }
}

}  // namespace
}  // namespace splitcubes::laws
