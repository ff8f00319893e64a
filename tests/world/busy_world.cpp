#include "busy_world.h"

#include <splitcubes/body/body.h>
#include <splitcubes/deformation/mass_spring.h>

#include "laws/worlds.h"

#include <memory>

namespace splitcubes::body::busy {

using namespace laws;

namespace {

geometry::TriangleMesh shifted_box(const Vec3& size, const Vec3& centre) {
    geometry::TriangleMesh mesh = geometry::make_box(size);
    for (Vec3& p : mesh.positions) p += centre;
    return mesh;
}

double cell_of(Size size) {
    return size == Size::usual ? 0.02 : 0.03;
}

// Adds a rotating block that falls on the ground and is cut by three blades, finally into rigid fragments.
void add_block(World& world, Size size) {
    BodySettings block = soft(cell_of(size), 50);
    block.name = "block";
    block.angular_velocity = Vec3(0.5, 0.3, -0.4);
    world.add_body(shifted_box(Vec3(0.16, 0.12, 0.1), Vec3(0, 0, 0.08)), block);
}

// Adds a bar that is held at one end and bent past yield at the other.
void add_bar(World& world, Size size) {
    BodySettings bar = soft(cell_of(size), 30);
    bar.name = "bar";
    bar.material.plasticity = meshless::Plasticity{};
    bar.material.plasticity->yield = 0.01;
    Body& body = world.add_body(shifted_box(Vec3(0.2, 0.06, 0.06), Vec3(0, 0.4, 0.3)), bar);
    body.add_constraint(hold_beyond(Vec3(0.06, 0, 0), Vec3::UnitX()));
    Handle handle;
    handle.region = [](const Vec3& p) { return p.x() < -0.06; };
    handle.motion = [](double time) { return Isometry(Eigen::Translation3d(0.05 * time, 0, 0.5 * time)); };
    handle.stiffness = 200;
    handle.limit = 2;
    body.add_handle(handle);
}

// Adds a body that is pulled until it tears.
void add_strip(World& world) {
    BodySettings strip = soft(0.02, 30);
    strip.name = "strip";
    strip.tearing = TearSettings{};
    strip.tearing->strength = 2e4;
    Body& body = world.add_body(shifted_box(Vec3(0.2, 0.06, 0.06), Vec3(0, -0.4, 0.3)), strip);
    body.add_constraint(hold_beyond(Vec3(0.06, 0, 0), Vec3::UnitX()));
    HoldConstraint moved_end = hold_beyond(Vec3(-0.06, 0, 0), -Vec3::UnitX());
    moved_end.motion = [](double time) { return Isometry(Eigen::Translation3d(-0.2 * time, 0, 0)); };
    body.add_constraint(moved_end);
}

// Adds a body of springs between grid nodes, which a blade cuts.
void add_jelly(World& world, Size size) {
    BodySettings jelly = soft(cell_of(size), 30);
    jelly.name = "jelly";
    jelly.deformation = [](deformation::NodeSet nodes) -> std::unique_ptr<deformation::Deformation> {
        deformation::MassSpringSettings settings;
        settings.youngs_modulus = 2e4;
        return std::make_unique<deformation::MassSpring>(std::move(nodes), settings);
    };
    world.add_body(shifted_box(Vec3(0.08, 0.08, 0.08), Vec3(0.5, 0, 0.08)), jelly);
}

}  // namespace

std::unique_ptr<World> make(meshless::SolverKind solver, Size size, int thread_count) {
    WorldSettings settings = free_space();
    settings.validate_each_step = false;
    settings.gravity = Vec3(0, 0, -9.81);
    settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.4};
    settings.contact.restitution = 0.6;
    settings.solver.kind = solver;
    auto world = std::make_unique<World>(settings, threads(thread_count));
    add_block(*world, size);
    add_bar(*world, size);
    add_strip(*world);
    add_jelly(*world, size);
    Collider ball;
    ball.solid = geometry::make_sphere_distance(0.05);
    ball.motion = [](double time) {
        return Isometry(Eigen::Translation3d(0.25 - 0.5 * time, 0, 0.05) *
                        Eigen::AngleAxisd(-10 * time, Vec3::UnitY()));
    };
    world->add_collider(ball);
    world->add_tool(moving_blade(Vec3(0.01, -0.2, 0), Vec3(-0.01, 0.2, 0.02), Vec3(0.003, 0, 0.3),
                                 Vec3(0.02, 0, -0.1), 0.02, 0.2));
    world->add_tool(moving_blade(Vec3(-0.2, 0, 0), Vec3(0.2, 0.01, 0), Vec3(0, -0.2, 0.06),
                                 Vec3(0, 0.2, 0.05), 0.05, 0.25, 2));
    world->add_tool(moving_blade(Vec3(-0.2, -0.1, 0), Vec3(0.2, 0.1, 0), Vec3(0, -0.05, 0.3),
                                 Vec3(0, -0.04, -0.05), 0.08, 0.25));
    world->add_tool(
        moving_blade(Vec3(0.5, -0.2, 0), Vec3(0.51, 0.2, 0), Vec3(0, 0, 0.3), Vec3(0, 0, -0.1), 0.02, 0.3));
    return world;
}

}  // namespace splitcubes::body::busy
