#include "paper_world.h"

#include <splitcubes/body/body.h>
#include <splitcubes/geometry/shapes.h>

namespace splitcubes::app {

std::unique_ptr<body::World> make_paper_world(const std::shared_ptr<const Parallel>& parallel,
                                              occlusion::CriterionKind criterion) {
    constexpr double side = 0.2;
    body::WorldSettings settings;
    settings.time_step = 1.0 / 60;
    auto world = std::make_unique<body::World>(settings, parallel);
    body::BodySettings cube;
    cube.name = "cube";
    cube.cell_size = side / 20;
    cube.phyxel_count = 800;
    cube.criterion = criterion;
    cube.material.youngs_modulus = 2.5e5;
    cube.material.poisson_ratio = 0.33;
    body::Body& body = world->add_body(geometry::make_box(Vec3::Constant(side)), cube);
    body::HoldConstraint hold;
    hold.region = [](const Vec3& rest) { return rest[0] < -0.4 * side; };
    hold.motion = [](double) { return Isometry::Identity(); };
    body.add_constraint(hold);
    const cutting::BladeShape shape = cutting::make_straight_blade({0, -0.7 * side, 0}, {0, 0.7 * side, 0});
    world->add_tool(cutting::Blade("blade", shape,
                                   {{0.1, {0.013 * side, 0, 0.6 * side}, Quat::Identity()},
                                    {1.1, {0.013 * side, 0, -0.8 * side}, Quat::Identity()}}));
    return world;
}

}  // namespace splitcubes::app
