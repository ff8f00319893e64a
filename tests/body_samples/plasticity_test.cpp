// Plastic strain is kept through cutting and resampling.
#include "laws/worlds.h"

#include <gtest/gtest.h>
#include <splitcubes/body/body.h>
#include <splitcubes/elasticity/constitutive.h>
#include <splitcubes/world/world.h>

#include <memory>

namespace splitcubes::body {
namespace {

using namespace laws;

// Block with uniform plastic strain at rest in its stress-free shape.
struct Flowed {
    Flowed(meshless::MaterialModel model, meshless::SolverKind solver) {
        WorldSettings settings = free_space();
        settings.solver.kind = solver;
        world = std::make_unique<World>(settings, threads(2));
        BodySettings block = soft(0.0141, 150);
        block.material.model = model;
        block.material.plasticity = meshless::Plasticity{};
        body = &world->add_body(geometry::make_box(Vec3(0.2, 0.18, 0.16)), block);
        strain << 0.1, 0.03, 0, 0.03, -0.08, 0.02, 0, 0.02, 0.05;
        const Mat3 shape = meshless::stretch_of(block.material, strain);
        meshless::Phyxels& phyxels = body->phyxels();
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            phyxels.plastic_strain[i] = strain;
            phyxels.position[i] = phyxels.previous_position[i] = shape * phyxels.rest_position[i];
            phyxels.deformation[i] = shape;
        }
        world->step();  // moves the nodes
    }
    std::unique_ptr<World> world;
    Body* body = nullptr;
    Mat3 strain;
};

TEST(PlasticBody, PlasticStrainSurvivesCutsAndFragmentation) {
    int remade = 0;
    for (const auto model :
         {meshless::MaterialModel::corotated, meshless::MaterialModel::st_venant_kirchhoff})
        for (const auto solver : {meshless::SolverKind::implicit_steps, meshless::SolverKind::explicit_steps})
            for (const double depth : {1.3, 2.5, 6.0}) {
                Flowed flowed(model, solver);
                Body& body = *flowed.body;
                const std::size_t before = body.phyxels().size();
                const Vec3 normal = Vec3(1, 1.02, 0.98).normalized();
                const Vec3 corner = Vec3(0.1, 0.09, 0.08) - depth * 0.0141 * normal;
                body.cut_with_sheet(geometry::make_plane_sheet(corner, normal, 1), 0,
                                    flowed.world->parallel());
                ASSERT_EQ(body.pieces().count(), 2U);
                remade += body.phyxels().size() > before || !body.phyxels().rigid.empty();
                for (const Mat3& strain : body.phyxels().plastic_strain)
                    ASSERT_LT((strain - flowed.strain).norm(), 1e-12);
                for (int step = 0; step < 5; ++step) {
                    const StepReport report = flowed.world->step();
                    ASSERT_LT(report.totals.elastic_energy, 1e-12) << "nothing was released";
                    // Strain within single precision.
                    ASSERT_LT(report.totals.top_speed, 5e-6);
                }
            }
    EXPECT_GE(remade, 4) << "some fragments get new phyxels or become rigid";
}

TEST(PlasticBody, StrainIsPartOfTheStateHash) {
    Flowed a(meshless::MaterialModel::corotated, meshless::SolverKind::implicit_steps);
    const std::string before = a.world->state_hash().text();
    EXPECT_EQ(a.world->state_hash().text(), before);
    a.body->phyxels().plastic_strain[3](0, 1) += 1e-15;
    EXPECT_NE(a.world->state_hash().text(), before);
}

}  // namespace
}  // namespace splitcubes::body
