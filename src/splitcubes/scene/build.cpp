#include <splitcubes/body/body.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/memory.h>
#include <splitcubes/deformation/free_form.h>
#include <splitcubes/deformation/mass_spring.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/scene/advice.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/implicit_model.h>
#include <splitcubes/scene/instrument.h>
#include <splitcubes/scene/motion.h>
#include <splitcubes/scene/overloaded.h>
#include <splitcubes/scene/strength.h>
#include <splitcubes/scene/tuning.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::scene {

namespace {

io::Model model_of_shape(const BodyDescription& body, BuildReport& report, const Parallel& parallel) {
    if (const auto* shape = std::get_if<MeshShape>(&body.shape)) {
        io::ReadMeshReport read;
        io::Model model = io::read_model(shape->file, &read);
        for (const std::string& note : read.notes) report.notes.push_back({body.name, note});
        report.files[shape->file] = std::move(read.files);
        return model;
    }
    if (const auto* shape = std::get_if<ImplicitShape>(&body.shape))
        return implicit_model(*shape, body.name, parallel);
    return {shape_mesh(body.shape, parallel), {}};
}

// The motion `own` of what goes along with something from a time on, s, as far as time alone decides.
std::function<Isometry(double)> carried_on(const std::optional<Carrier>& carrier, double from_time,
                                           std::function<Isometry(double)> own,
                                           const SceneDescription& scene) {
    const auto outer = carrier ? prescribed_motion(*carrier, scene.colliders, scene.tools) : std::nullopt;
    if (!outer) return own;
    ToolDescription path;
    path.blades.push_back(StraightBlade{});
    path.motion = *outer;
    return [from_time, own = std::move(own), blade = make_blade(path)](double time) {
        return motion_since(blade, from_time, time) * own(time);
    };
}

void add_constraint(const ConstraintDescription& c, const SceneDescription& scene, body::Body& target,
                    std::size_t constraint_index) {
    const auto region = region_test(c.region);
    if (!target.has_phyxel_in(region))
        throw InputError("constraints[" + std::to_string(constraint_index) + "]",
                         "its region holds no phyxel of body '" + c.body + "'",
                         "make it larger, or the phyxel spacing smaller (now " +
                             std::to_string(target.phyxel_spacing()) + " m)");
    body::HoldConstraint hold;
    hold.region = region;
    const auto own = [c](double time) {
        return c.kind == ConstraintKind::hold ? Isometry::Identity()
                                              : keyframe_motion(c.keyframes, c.pivot, time);
    };
    hold.motion = carried_on(c.relative_to, c.from_time, own, scene);
    hold.from = c.from_time;
    if (c.until_time) hold.until = *c.until_time;
    target.add_constraint(std::move(hold));
}

void add_handle(const HandleDescription& h, const SceneDescription& scene, body::Body& target) {
    const auto region = region_test(h.region);
    if (!target.has_phyxel_in(region))
        throw InputError("handle '" + h.name + "'", "its region holds no phyxel of body '" + h.body + "'",
                         "make it larger, or the phyxel spacing smaller (now " +
                             std::to_string(target.phyxel_spacing()) + " m)");
    body::Handle handle;
    handle.name = h.name;
    handle.region = region;
    handle.motion = handle_motion(h, scene);
    handle.stiffness = h.stiffness;
    if (h.force_limit) handle.limit = *h.force_limit;
    handle.from = h.from_time;
    if (h.until_time) handle.until = *h.until_time;
    target.add_handle(std::move(handle));
}

meshless::Material material_of(const MaterialDescription& m) {
    meshless::Material out{.model = m.model == MaterialModel::st_venant_kirchhoff
                                        ? meshless::MaterialModel::st_venant_kirchhoff
                                        : meshless::MaterialModel::corotated,
                           .density = m.density,
                           .youngs_modulus = m.youngs_modulus,
                           .poisson_ratio = m.poisson_ratio,
                           .volume_stiffness = m.volume_stiffness,
                           .mass_damping = m.mass_damping,
                           .stiffness_damping = m.stiffness_damping,
                           .zero_energy = m.zero_energy,
                           .plasticity = {},
                           .cutting_resistance = m.cutting_resistance};
    if (!m.plasticity) return out;
    out.plasticity = meshless::Plasticity{};
    out.plasticity->yield = m.plasticity->yield;
    if (m.plasticity->creep) out.plasticity->creep = *m.plasticity->creep;
    out.plasticity->maximum = m.plasticity->maximum;
    return out;
}

deformation::MakeDeformation free_form(const FreeFormDescription& form, const geometry::Box& box) {
    deformation::FreeFormSettings settings;
    settings.degree = form.degree;
    const Vec3i count = form.degree + Vec3i::Ones();
    for (const LatticeKeyframeDescription& key : form.keyframes) {
        deformation::LatticeKeyframe out{
            key.time, std::vector<Vec3>(static_cast<std::size_t>(count.prod()), Vec3::Zero())};
        for (const LatticePoint& p : key.points)
            out.displacement[static_cast<std::size_t>((p.index[2] * count[1] + p.index[1]) * count[0] +
                                                      p.index[0])] = p.displacement;
        settings.keyframes.push_back(std::move(out));
    }
    return [settings, box](deformation::NodeSet nodes) {
        return std::make_unique<deformation::FreeForm>(std::move(nodes), settings, box);
    };
}

deformation::MakeDeformation deformation_of(const BodyDescription& b, const geometry::Box& box) {
    if (const auto* form = std::get_if<FreeFormDescription>(&*b.deformation)) return free_form(*form, box);
    deformation::MassSpringSettings settings;
    settings.youngs_modulus = b.material.youngs_modulus;
    settings.mass_damping = b.material.mass_damping;
    settings.stiffness_damping = b.material.stiffness_damping;
    return [settings](deformation::NodeSet nodes) {
        return std::make_unique<deformation::MassSpring>(std::move(nodes), settings);
    };
}

// placed: the model, world at time 0; own: its mesh in its own frame.
body::BodySettings body_settings(const BodyDescription& b, const io::Model& placed,
                                 const geometry::TriangleMesh& own, const SceneDescription& scene) {
    body::BodySettings s;
    s.name = b.name;
    s.cell_size = b.cell_size ? *b.cell_size : geometry::cell_size_for(own, *b.cells);
    s.phyxel_spacing = b.phyxel_spacing.value_or(0);
    s.phyxel_count = b.phyxel_count.value_or(0);
    s.material = material_of(b.material);
    s.velocity = b.velocity;
    s.angular_velocity = b.angular_velocity;
    s.visibility.disk_size = scene.occlusion.disk_size;
    s.criterion = scene.occlusion.criterion;
    if (b.deformation) s.deformation = deformation_of(b, placed.mesh.bounds());
    if (b.material.tearing) s.tearing = tear_settings(*b.material.tearing, placed);
    return s;
}

void place(const Isometry& pose, geometry::TriangleMesh& mesh) {
    for (Vec3& p : mesh.positions) p = pose * p;
}

// Places the model and adds a body of it. Names the body in errors if the scene has several.
const body::Body& add_body(body::World& world, const BodyDescription& b, io::Model& model,
                           const SceneDescription& scene,
                           const decltype(body::BodySettings::make_visibility_backend)& make_opengl_backend) {
    try {
        geometry::TriangleMesh own = model.mesh;
        const Isometry pose = pose_of(b.placement);
        place(pose, model.mesh);
        geometry::require_coordinates(model.mesh, "mesh");
        body::BodySettings settings = body_settings(b, model, own, scene);
        if (scene.occlusion.backend == "opengl") settings.make_visibility_backend = make_opengl_backend;
        // A deformation is given in the world.
        if (settings.deformation) return world.add_body(model.mesh, settings);
        settings.pose = pose;
        return world.add_body(own, settings);
    } catch (const InputError& error) {
        throw InputError("body '" + b.name + "'", error.what());
    }
}

meshless::TimeScheme scheme_of(Integrator integrator) {
    switch (integrator) {
        case Integrator::backward_euler:
            return meshless::TimeScheme::backward_euler;
        case Integrator::tr_bdf2:
            return meshless::TimeScheme::tr_bdf2;
        default:
            return meshless::TimeScheme::bdf2;
    }
}

}  // namespace

geometry::TriangleMesh shape_mesh(const Shape& shape, const Parallel& parallel, BuildReport* report) {
    return std::visit(
        Overloaded{
            [report](const MeshShape& s) {
                io::ReadMeshReport read;
                geometry::TriangleMesh mesh = io::read_mesh(s.file, &read);
                if (report != nullptr) report->files[s.file] = std::move(read.files);
                return mesh;
            },
            [&](const ImplicitShape& s) { return implicit_model(s, "collider", parallel).mesh; },
            [](const BoxShape& s) { return geometry::make_box(s.size); },
            [](const SphereShape& s) { return geometry::make_sphere(s.radius, 5); },
            [](const CylinderShape& s) { return geometry::make_cylinder(s.radius, s.height, 128); },
            [](const TorusShape& s) { return geometry::make_torus(s.ring_radius, s.tube_radius); },
            [](const CapsuleShape& s) { return geometry::make_capsule(s.radius, s.straight_height, 96); },
            [](const PearShape& s) { return geometry::make_pear(s.height, 96, s.foot); }},
        shape);
}

Isometry collider_frame(const ColliderDescription& collider, double time) {
    return keyframe_motion(collider.keyframes, collider.pivot, time) * pose_of(collider.placement);
}

geometry::TriangleMesh collider_mesh(const ColliderDescription& collider, const Parallel& parallel,
                                     BuildReport* report) {
    if (!collider.shape) return {};
    geometry::TriangleMesh mesh = shape_mesh(*collider.shape, parallel, report);
    for (Vec3& p : mesh.positions) p = collider.placement.scale.cwiseProduct(p);
    return mesh;
}

body::Collider make_collider(const ColliderDescription& collider, const Parallel& parallel,
                             BuildReport* report) {
    body::Collider out;
    out.name = collider.name;
    out.friction = collider.friction;
    const Vec3& scale = collider.placement.scale;
    const bool is_uniform = scale == Vec3::Constant(scale.x());
    if (collider.half_space) {
        const Vec3 normal = collider.half_space->normal.normalized();
        out.solid = geometry::make_plane_distance(normal, normal.dot(collider.half_space->point));
    } else if (const auto* sphere = std::get_if<SphereShape>(&*collider.shape); sphere && is_uniform) {
        out.solid = geometry::make_sphere_distance(scale.x() * sphere->radius);
    } else if (const auto* box = std::get_if<BoxShape>(&*collider.shape)) {
        out.solid =
            geometry::make_box_distance(scale.cwiseProduct(box->size), scale.minCoeff() * collider.rounding);
    } else {
        constexpr int cells = tuning::build::collider_cells;
        out.solid = geometry::make_mesh_distance(collider_mesh(collider, parallel, report), cells, parallel);
    }
    out.motion = [collider](double time) { return collider_frame(collider, time); };
    return out;
}

std::function<Isometry(double)> handle_motion(const HandleDescription& h, const SceneDescription& scene) {
    const auto own = [h](double time) { return keyframe_motion(h.keyframes, h.pivot, time); };
    return carried_on(h.relative_to, h.from_time, own, scene);
}

body::Collider make_solid_tool(const ToolDescription& tool, const Parallel& parallel, BuildReport* report) {
    body::Collider out;
    out.name = tool.name;
    out.friction = tool.solid->friction;
    constexpr int cells = tuning::build::collider_cells;
    out.solid = geometry::make_mesh_distance(instrument_mesh(tool, report), cells, parallel);
    out.motion = [blade = make_blade(tool)](double time) { return blade.frame(time); };
    return out;
}

io::Model own_model(const BodyDescription& body, BuildReport& report, const Parallel& parallel) {
    io::Model model = model_of_shape(body, report, parallel);
    for (Vec3& p : model.mesh.positions) p = body.placement.scale.cwiseProduct(p);
    return model;
}

Isometry pose_of(const PlacementDescription& placement) {
    Isometry out = Isometry::Identity();
    out.linear() = quaternion(placement.rotation).toRotationMatrix();
    out.translation() = placement.position;
    return out;
}

io::Model placed_model(const BodyDescription& body, BuildReport& report, const Parallel& parallel) {
    io::Model model = own_model(body, report, parallel);
    place(pose_of(body.placement), model.mesh);
    return model;
}

std::unique_ptr<body::World> build_world(
    const SceneDescription& scene, std::shared_ptr<const Parallel> parallel, BuildReport& report,
    const decltype(body::BodySettings::make_visibility_backend)& make_opengl_backend) {
    if (scene.occlusion.backend == "opengl" && !make_opengl_backend)
        throw InputError("scene occlusion.backend", "is \"opengl\", which is not built in",
                         "take \"cpu\", or build with SPLITCUBES_BUILD_RENDER");
    body::WorldSettings settings;
    settings.time_step = scene.time_step;
    settings.gravity = scene.gravity;
    if (scene.ground)
        settings.ground = meshless::GroundPlane{Vec3::UnitZ(), scene.ground->height, scene.ground->friction};
    if (scene.solver.kind == SolverKind::explicit_steps)
        settings.solver.kind = meshless::SolverKind::explicit_steps;
    settings.contact.pieces = scene.contact.pieces;
    settings.contact.friction = scene.contact.friction;
    settings.contact.restitution = scene.contact.restitution;
    settings.solver.tolerance = scene.solver.tolerance;
    settings.solver.max_iterations = scene.solver.max_iterations;
    settings.solver.scheme = scheme_of(scene.solver.integrator);
    auto world = std::make_unique<body::World>(settings, std::move(parallel));
    for (const std::string& note : scene.deprecations) report.notes.push_back({scene.name, note});
    for (const BodyDescription& b : scene.bodies) {
        world->parallel().begin("body '" + b.name + "': shape");
        io::Model model = own_model(b, report, world->parallel());
        world->parallel().begin("body '" + b.name + "': solid");
        const body::Body& made = add_body(*world, b, model, scene, make_opengl_backend);
        for (const std::string& note : made.solidify_report().notes) report.notes.push_back({b.name, note});
        if (model.attributes.empty()) model.mesh = {};
        report.models.push_back(std::move(model));
    }
    const auto index_of_body = [&](const std::string& name) {
        for (std::size_t k = 0; k < scene.bodies.size(); ++k)
            if (scene.bodies[k].name == name) return k;
        throw InputError("scene", "there is no body '" + name + "'");
    };
    for (std::size_t k = 0; k < scene.constraints.size(); ++k)
        add_constraint(scene.constraints[k], scene,
                       *world->bodies()[index_of_body(scene.constraints[k].body)], k);
    for (const HandleDescription& handle : scene.handles)
        add_handle(handle, scene, *world->bodies()[index_of_body(handle.body)]);
    const auto solid_tools = static_cast<std::size_t>(
        std::count_if(scene.tools.begin(), scene.tools.end(), [](const auto& tool) { return tool.solid; }));
    constexpr double per_collider = tuning::build::bytes_per_collider;
    require_memory("colliders", per_collider * static_cast<double>(scene.colliders.size() + solid_tools),
                   "use fewer colliders");
    for (const ColliderDescription& collider : scene.colliders) {
        world->parallel().begin("collider '" + collider.name + "'");
        world->add_collider(make_collider(collider, world->parallel(), &report));
    }
    for (const ToolDescription& tool : scene.tools) {
        if (!tool.solid) continue;
        world->parallel().begin("tool '" + tool.name + "'");
        world->add_collider(make_solid_tool(tool, world->parallel(), &report));
    }
    world->parallel().begin("tools");
    for (const ToolDescription& tool : scene.tools) {
        std::vector<std::size_t> bodies;
        for (const std::string& name : tool.bodies) bodies.push_back(index_of_body(name));
        world->add_tool(make_blade(tool), bodies, {tool.side, tool.friction});
        if (tool.side > 0 && tool.friction > 0 && !scene.contact.pieces)
            report.notes.push_back({tool.name,
                                    "its sides bear no contact force and have no friction: these are "
                                    "found with contact.pieces"});
    }
    world->parallel().begin("advice");
    std::vector<std::uint8_t> prescribed;
    for (const BodyDescription& b : scene.bodies)
        prescribed.push_back(b.deformation && std::holds_alternative<FreeFormDescription>(*b.deformation));
    note_few_phyxels(*world, report.notes);
    note_damping_step(*world, report.notes);
    note_overlaps(*world, prescribed, report.notes);
    return world;
}

}  // namespace splitcubes::scene
