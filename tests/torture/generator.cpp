#include "generator.h"

#include "blades.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <stdexcept>

namespace splitcubes::torture {

namespace {

enum class Support { free, hung, shaken, ground, colliders };

// The settings of a scene that are drawn before its bodies are placed.
struct Plan {
    double time_step = 0;
    int frames = 0;
    int blades = 0;
    int phyxels = 0;
    bool is_explicit = false;
    double youngs_modulus = 0;
    Support support = Support::free;
    bool has_ground = false;
    Vec3 gravity = Vec3::Zero();

    double duration() const { return frames * time_step; }
};

int draw_blade_count(Draw& draw) {
    const auto range = draw.between(0, 9);
    if (range < 2) return static_cast<int>(draw.between(1, 10));
    if (range < 5) return static_cast<int>(draw.between(10, 40));
    if (range < 8) return static_cast<int>(draw.between(40, 100));
    return static_cast<int>(draw.between(100, 300));
}

Vec3 draw_gravity(Draw& draw, Support support) {
    const auto kind = draw.between(0, 7);
    const Vec3 tilted = 9.81 * draw.direction();
    if (support == Support::free && kind < 4) return Vec3::Zero();
    if (support != Support::ground && support != Support::colliders && kind == 4) return rounded(tilted);
    return {0, 0, -9.81};
}

Plan draw_plan(Draw& draw, const Limits& limits) {
    constexpr std::array<int, 8> rates = {30, 60, 60, 90, 120, 240, 500, 1000};
    Plan plan;
    plan.is_explicit = draw.chance(1, 3) && !limits.without.contains("explicit");
    plan.youngs_modulus = draw.decades(3, 8);
    auto rate = rates[static_cast<std::size_t>(draw.between(0, 7))];
    // The substeps of a stiff body would take minutes.
    if (plan.is_explicit && plan.youngs_modulus >= 1e6) rate = std::max(rate, 240);
    plan.time_step = 1.0 / rate;
    plan.frames = static_cast<int>(draw.between(60, 90));
    plan.blades = std::min(draw_blade_count(draw), limits.max_blades);
    const double size = draw.real(0, 1);
    plan.phyxels = 360 + static_cast<int>(size * size * std::max(0, limits.max_phyxels - 360));
    plan.support = static_cast<Support>(draw.between(0, 4));
    plan.has_ground = draw.chance(1, 2) || plan.support == Support::ground;
    if (plan.support == Support::shaken && limits.without.contains("shaking")) plan.support = Support::hung;
    if (plan.support == Support::colliders && limits.without.contains("colliders"))
        plan.support = Support::ground, plan.has_ground = true;
    if (limits.without.contains("ground")) {
        plan.has_ground = false;
        if (plan.support == Support::ground) plan.support = Support::free;
    }
    if (plan.support == Support::free) plan.has_ground = false;
    plan.gravity = draw_gravity(draw, plan.support);
    return plan;
}

Json draw_material(Draw& draw, const Plan& plan, double density, const Limits& limits) {
    const double modulus = plan.youngs_modulus;
    const bool corotated = draw.chance(3, 5);
    const double poisson = static_cast<double>(draw.between(0, 49)) / 100;
    Json out = {{"model", corotated ? "corotated" : "st-venant-kirchhoff"},
                {"density", density},
                {"youngs_modulus", rounded(modulus)},
                {"poisson_ratio", poisson}};
    const bool volume = draw.chance(3, 4), damped = draw.chance(1, 4), dragged = draw.chance(1, 8);
    const double k = draw.real(0.5, 1.5), damping = draw.decades(-5, -3), drag = draw.real(0.1, 2);
    if (!corotated && volume) out["volume_stiffness"] = rounded(k * modulus);
    if (damped) out["stiffness_damping"] = rounded(damping);
    if (dragged) out["mass_damping"] = rounded(drag);
    const bool plastic = draw.chance(1, 4), tears = draw.chance(1, 5), toughness = draw.chance(1, 4);
    const double yield = draw.real(0.02, 0.3), creep = draw.decades(-1, 3), strength = draw.real(0.03, 0.4);
    const bool creeps = draw.chance(1, 2);
    if (plastic && !limits.without.contains("plasticity")) {
        out["plasticity"] = {{"yield", rounded(yield)}};
        if (creeps) out["plasticity"]["creep"] = rounded(creep);
    }
    if (tears && !limits.without.contains("tearing"))
        out["tearing"] = {{"strength", rounded(strength * modulus)}};
    if (toughness) out["cutting_resistance"] = draw.between(1, 500);
    return out;
}

// The largest spacing, in millionths of a metre, of which as many cubes as phyxels fill the volume.
double spacing_of(double volume, int phyxels) {
    double spacing = 1e-3;
    while (spacing * spacing * spacing * phyxels < volume) spacing += 1e-6;
    return rounded(spacing);
}

// Positions that swing about zero in parabolic arcs, so that their velocity is continuous and zero at first.
Json swing(Draw& draw, double amplitude, const Plan& plan) {
    const Vec3 direction = draw.direction();
    const double half = std::max(4 * plan.time_step, draw.real(0.04, 0.2));
    Json keys = Json::array();
    for (int k = 0; k <= plan.frames; ++k) {
        const double time = k * plan.time_step, phase = time / half + 0.5;
        const double arc = std::floor(phase), part = phase - arc;
        const double sign = static_cast<std::int64_t>(arc) % 2 == 0 ? 1 : -1;
        const double offset = amplitude * (sign * 4 * part * (1 - part) - 1) / 2;
        // Times are in whole millionths; steps of 1/30 s are not.
        keys.push_back({{"time", rounded(time)}, {"position", to_json(rounded(Vec3(offset * direction)))}});
    }
    return keys;
}

struct Scene {
    Plan plan;
    std::vector<Solid> solids;
    GeneratedScene out;
    Vec3 velocity = Vec3::Zero();
    double cell_size = 0;
};

// All bodies have the same cells and density, so that depths and masses need no attribution.
void add_bodies(Draw& draw, Scene& scene, const Limits& limits) {
    const bool two = draw.chance(1, 6) && !limits.without.contains("bodies");
    const int count = two ? 2 : 1;
    double volume = 0;
    for (int k = 0; k < count; ++k) {
        Solid solid = draw_solid(draw, limits.models);
        Vec3 offset = -solid.center();
        if (k == 1) offset.z() += scene.solids[0].high.z() - (solid.low.z() + offset.z()) + 0.004;
        solid.move(offset);
        volume += solid.volume;
        scene.solids.push_back(std::move(solid));
    }
    const double spacing = spacing_of(volume, std::max(scene.plan.phyxels, 350 * count));
    scene.cell_size = rounded(spacing / draw.real(2, 2.5));
    const double density = static_cast<double>(draw.between(5, 20)) * 100;
    const Vec3 velocity = draw.in_cube(1), spin = draw.in_cube(6);
    const bool moves = scene.plan.support == Support::free || draw.chance(1, 4);
    const Json material = draw_material(draw, scene.plan, density, limits);
    Json bodies = Json::array();
    for (int k = 0; k < count; ++k) {
        const std::string name = "body" + std::to_string(k);
        const Solid& solid = scene.solids[static_cast<std::size_t>(k)];
        Json body = {{"name", name}};
        if (solid.implicit.is_null()) {
            body["shape"] = {{"mesh", {{"file", name + ".obj"}}}};
            scene.out.files[name + ".obj"] = coloured_obj(solid.mesh);
        } else {
            body["shape"] = {{"implicit", solid.implicit}};
        }
        body["cell_size"] = scene.cell_size;
        body["phyxel_spacing"] = spacing;
        body["material"] = material;
        if (moves) {
            scene.velocity = rounded(velocity);
            body["velocity"] = to_json(scene.velocity);
            if (count == 1) body["angular_velocity"] = to_json(rounded(spin));
        }
        bodies.push_back(body);
    }
    scene.out.scene["bodies"] = bodies;
}

double lowest_of(const Scene& scene, const Vec3& direction) {
    double out = 1e9;
    for (const Solid& solid : scene.solids) out = std::min(out, solid.lowest(direction));
    return out;
}

// A collider under the bodies that touches none of them at any time of its motion.
Json draw_collider(Draw& draw, const Scene& scene, int number, const Limits& limits) {
    Json out = {{"name", "collider" + std::to_string(number)}};
    const double gap = draw.real(0.001, 0.02);
    const double radius = scene.solids[0].radius(), bottom = lowest_of(scene, Vec3::UnitZ());
    const bool moves = draw.chance(1, 3) && !limits.without.contains("shaking");
    const double amplitude = rounded(draw.real(0.02, 0.2) * radius);
    Json swinging = swing(draw, amplitude, scene.plan);
    const double top = bottom - gap - (moves ? amplitude : 0);
    const double x = draw.real(-0.5, 0.5) * radius, y = draw.real(-0.5, 0.5) * radius;
    const double r = rounded(draw.real(0.3, 1.5) * radius);
    const auto kind = draw.between(0, 2);
    if (kind == 0) {
        // Arguments are evaluated in any order: draws are named first.
        const double slope_y = draw.real(-0.5, 0.5), slope_x = draw.real(-0.5, 0.5);
        const Vec3 normal = Vec3(slope_x, slope_y, 1).normalized();
        const double level = lowest_of(scene, normal) - gap - (moves ? amplitude : 0);
        out["half_space"] = {{"point", to_json(rounded(Vec3(level * normal)))}, {"normal", to_json(normal)}};
    } else if (kind == 1) {
        out["shape"] = {{"sphere", {{"radius", r}}}};
        out["placement"] = {{"position", to_json(rounded(Vec3(x, y, top - r)))}};
    } else {
        const double height = draw.real(0.2, 1), depth = draw.real(0.5, 2);
        const Vec3 size = rounded(Vec3(2 * r, depth * r, height * r));
        out["shape"] = {{"box", {{"size", to_json(size)}}}};
        out["placement"] = {
            {"position", to_json(rounded(Vec3(x, y, top - size.norm() / 2)))},
            {"rotation",
             {{"axis", to_json(rounded(draw.direction()))}, {"angle_degrees", draw.between(-180, 180)}}}};
        if (draw.chance(1, 2)) out["rounding"] = rounded(draw.real(0.02, 0.2) * size.minCoeff());
    }
    if (moves) out["keyframes"] = std::move(swinging);
    out["friction"] = rounded(draw.real(0, 1));
    return out;
}

void add_surroundings(Draw& draw, Scene& scene, const Limits& limits) {
    Json& json = scene.out.scene;
    const Plan& plan = scene.plan;
    const double bottom = lowest_of(scene, Vec3::UnitZ());
    const double gap = draw.real(0.0005, 0.02);
    const double friction = rounded(draw.real(0, 1)), drop = draw.real(0, 0.3);
    if (plan.support == Support::colliders) {
        Json colliders = Json::array();
        const auto count = draw.between(1, 2);
        for (int k = 0; k < count; ++k) colliders.push_back(draw_collider(draw, scene, k, limits));
        json["colliders"] = colliders;
    }
    const double below = plan.support == Support::ground ? gap : gap + drop;
    if (plan.has_ground) json["ground"] = {{"height", rounded(bottom - below)}, {"friction", friction}};
}

void add_holds(Draw& draw, Scene& scene) {
    const Plan& plan = scene.plan;
    if (plan.support != Support::hung && plan.support != Support::shaken) return;
    Json constraints = Json::array();
    for (std::size_t k = 0; k < scene.solids.size(); ++k) {
        const Solid& solid = scene.solids[k];
        const double level = solid.high.z() - draw.real(0.15, 0.4) * (solid.high.z() - solid.low.z());
        Json hold = {
            {"body", "body" + std::to_string(k)},
            {"region",
             {{"half_space",
               {{"point", to_json(rounded(Vec3(0, 0, level)))}, {"normal", to_json(Vec3::UnitZ())}}}}},
            {"kind", "hold"}};
        if (plan.support == Support::shaken) {
            hold["kind"] = "move";
            hold["keyframes"] = swing(draw, draw.real(0.05, 0.3) * solid.radius(), plan);
        }
        if (draw.chance(1, 4)) hold["until_time"] = rounded(draw.real(0.3, 1) * plan.duration());
        constraints.push_back(hold);
    }
    scene.out.scene["constraints"] = constraints;
}

void add_handle(Draw& draw, Scene& scene, const Limits& limits) {
    const Solid& solid = scene.solids[0];
    const bool wanted = draw.chance(1, 8) && !limits.without.contains("handles");
    const Vec3 side = draw.direction(), way = draw.in_cube(1);
    const double stiffness = draw.real(0.02, 0.3), limit = draw.real(0.5, 5);
    if (!wanted) return;
    const Vec3 extent = (solid.high - solid.low) / 2;
    const double radius = 0.5 * solid.radius();
    const Vec3 at = solid.center() + 0.5 * side.cwiseProduct(extent);
    const double end = scene.plan.duration();
    scene.out.scene["handles"] = Json::array(
        {{{"name", "handle"},
          {"body", "body0"},
          {"region", {{"sphere", {{"center", to_json(rounded(at))}, {"radius", rounded(radius)}}}}},
          {"stiffness", rounded(stiffness * scene.plan.youngs_modulus * solid.radius())},
          {"force_limit", rounded(limit * 9.81 * 1000 * solid.volume)},
          {"keyframes",
           {{{"time", 0}, {"position", to_json(Vec3::Zero())}},
            {{"time", rounded(0.7 * end)}, {"position", to_json(rounded(Vec3(solid.radius() * way)))}}}}}});
}

void add_tools(Draw& draw, Scene& scene) {
    const Plan& plan = scene.plan;
    std::vector<Target> targets;
    for (std::size_t k = 0; k < scene.solids.size(); ++k) {
        const Solid& solid = scene.solids[k];
        Target target;
        target.center = solid.center();
        target.radius = solid.radius();
        target.cell_size = scene.cell_size;
        target.name = "body" + std::to_string(k);
        if (plan.support == Support::free) {
            target.velocity = scene.velocity;
            target.gravity = plan.gravity;
            target.longest_fall = plan.duration();
        }
        targets.push_back(target);
    }
    scene.out.scene["tools"] = draw_tools(draw, targets, plan.blades, plan.duration(), plan.time_step);
}

void add_solver(Draw& draw, Scene& scene, const Limits& limits) {
    Json& json = scene.out.scene;
    const bool contact = draw.chance(1, 2) && !limits.without.contains("contact");
    const double friction = rounded(draw.real(0, 1));
    json["contact"] = {{"pieces", contact}, {"friction", friction}};
    constexpr std::array<const char*, 6> integrators = {"bdf2", "bdf2",           "bdf2",
                                                        "bdf2", "backward_euler", "tr_bdf2"};
    const char* integrator = integrators[static_cast<std::size_t>(draw.between(0, 5))];
    json["solver"] = {{"kind", scene.plan.is_explicit ? "explicit" : "implicit"}};
    if (!scene.plan.is_explicit) json["solver"]["integrator"] = integrator;
}

}  // namespace

const std::vector<std::string>& feature_names() {
    static const std::vector<std::string> names = {"bodies",  "colliders", "contact", "explicit",
                                                   "ground",  "handles",   "holds",   "plasticity",
                                                   "shaking", "tearing"};
    return names;
}

GeneratedScene make_scene(std::uint64_t seed, const Limits& limits) {
    Draw draw(seed);
    Scene scene;
    scene.plan = draw_plan(draw, limits);
    Json& json = scene.out.scene;
    json["name"] = "torture " + std::to_string(seed);
    json["time_step"] = scene.plan.time_step;
    json["frames"] = scene.plan.frames;
    json["threads"] = 1;
    json["gravity"] = to_json(scene.plan.gravity);
    add_bodies(draw, scene, limits);
    add_surroundings(draw, scene, limits);
    if (!limits.without.contains("holds")) add_holds(draw, scene);
    add_handle(draw, scene, limits);
    add_solver(draw, scene, limits);
    add_tools(draw, scene);
    return std::move(scene.out);
}

void write_scene(const GeneratedScene& generated, const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    const auto write = [&](const std::string& name, const std::string& text) {
        std::ofstream out(folder / name, std::ios::binary);
        out << text;
        if (!out.flush())
            throw std::runtime_error((folder / name).string() +
                                     ": cannot be written; free space, or another folder");
    };
    for (const auto& [name, text] : generated.files) write(name, text);
    write("scene.json", generated.scene.dump(1) + "\n");
}

}  // namespace splitcubes::torture
