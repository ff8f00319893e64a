#include <splitcubes/api/internal/convert.h>
#include <splitcubes/api/internal/state_archive.h>
#include <splitcubes/core/error.h>
#include <splitcubes/geometry/coordinate_limit.h>
#include <splitcubes/math/state_numbers.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

namespace splitcubes::api {

namespace {

template <class A, class T>
void flag(A& a, T& value) {
    std::uint8_t byte = value ? 1 : 0;
    a.number(byte);
    require_state(byte <= 1, "a mark that there is not");
    value = byte == 1;
}

template <class A>
void vector3(A& a, Vec3& v) {
    for (int k = 0; k < 3; ++k) a.number(v[k]);
    require_state(are_state_numbers({v.data(), 3}), "a vector that is no number");
}

template <class A>
void vector3(A& a, Vector3& v) {
    for (double* value : {&v.x, &v.y, &v.z}) a.number(*value);
}

template <class A, class T>
void numbers(A& a, std::vector<T>& values) {
    values.resize(a.count(values.size(), sizeof(T)));
    for (T& value : values) a.number(value);
}

// Arrays of arrays of numbers.
template <class A, class T, std::size_t N>
void rows(A& a, std::vector<std::array<T, N>>& values) {
    values.resize(a.count(values.size(), N));
    for (auto& row : values)
        for (auto& value : row)
            if constexpr (std::is_arithmetic_v<std::remove_reference_t<decltype(value)>>)
                a.number(value);
            else
                for (float& part : value) {
                    a.number(part);
                    require_state(std::isfinite(part), "an attribute that is no number");
                }
}

template <class A>
void id_numbers(A& a, std::uint32_t& index, std::uint32_t& generation) {
    a.number(index);
    a.number(generation);
    require_state(generation != 0, "an id of nothing");
}

template <class A, class Tag>
void id_of(A& a, Id<Tag>& id) {
    id_numbers(a, id.index, id.generation);
}

template <class A>
void pose(A& a, Isometry& frame) {
    for (int k = 0; k < 12; ++k) a.number(frame.matrix()(k / 4, k % 4));
    require_state(frame.matrix().allFinite() && is_rotation(frame.linear(), 1e-6), "a pose that is none");
}

template <class A>
void motion(A& a, SampledMotion& samples) {
    std::vector<double> times = samples.times();
    numbers(a, times);
    std::vector<Isometry> frames = samples.frames();
    frames.resize(times.size(), Isometry::Identity());
    for (Isometry& frame : frames) pose(a, frame);
    if constexpr (A::loads) {
        samples = {};
        require_state(!times.empty(), "a path without a pose");
        for (std::size_t k = 0; k < times.size(); ++k) samples.add(times[k], frames[k]);
    }
}

template <class A>
void track(A& a, Track& samples) {
    if (A::loads) samples = std::make_shared<SampledMotion>();
    motion(a, *samples);
}

template <class A>
void mesh(A& a, geometry::TriangleMesh& m) {
    m.positions.resize(a.count(m.positions.size(), sizeof(Vec3)));
    for (Vec3& p : m.positions) vector3(a, p);
    rows(a, m.triangles);
    for (const geometry::Triangle& t : m.triangles)
        for (const std::uint32_t v : t) require_state(v < m.positions.size(), "a triangle of no vertices");
    if (A::loads) geometry::require_coordinates(m, "mesh");
}

template <class A>
void image(A& a, std::shared_ptr<const geometry::EmbeddedImage>& picture) {
    bool has = picture != nullptr;
    flag(a, has);
    if (!has) return;
    geometry::EmbeddedImage copy = picture ? *picture : geometry::EmbeddedImage{};
    a.text(copy.mime_type);
    std::string bytes(reinterpret_cast<const char*>(copy.bytes.data()), copy.bytes.size());
    a.text(bytes);
    const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
    copy.bytes.assign(first, first + bytes.size());
    picture = std::make_shared<const geometry::EmbeddedImage>(std::move(copy));
}

template <class A>
void attributes(A& a, geometry::MeshAttributes& m, std::size_t triangles) {
    rows(a, m.corner_uv);
    rows(a, m.corner_colour);
    numbers(a, m.triangle_material);
    m.materials.resize(a.count(m.materials.size(), 33));
    for (geometry::Material& material : m.materials) {
        a.text(material.name);
        a.text(material.texture);
        for (float& channel : material.colour) a.number(channel);
        image(a, material.image);
    }
    for (const std::size_t size : {m.corner_uv.size(), m.corner_colour.size(), m.triangle_material.size()})
        require_state(size == 0 || size == triangles, "attributes of other triangles");
    for (const std::int32_t material : m.triangle_material)
        require_state(material >= -1 && material < static_cast<std::int32_t>(m.materials.size()),
                      "a material that there is not");
}

template <class A>
void plasticity(A& a, std::optional<meshless::Plasticity>& p) {
    bool flows = p.has_value();
    flag(a, flows);
    if (!flows) return;
    if (A::loads) p.emplace();
    a.number(p->yield);
    a.number(p->creep);
    a.number(p->maximum);
}

template <class A>
void body_settings(A& a, body::BodySettings& s) {
    a.text(s.name);
    pose(a, s.pose);
    for (double* value : {&s.cell_size, &s.phyxel_spacing, &s.material.density, &s.material.youngs_modulus,
                          &s.material.poisson_ratio, &s.material.mass_damping, &s.material.stiffness_damping,
                          &s.material.cutting_resistance})
        a.number(*value);
    a.number(s.phyxel_count);
    vector3(a, s.velocity);
    vector3(a, s.angular_velocity);
    plasticity(a, s.material.plasticity);
    bool tears = s.tearing.has_value();
    flag(a, tears);
    if (A::loads) {
        require_at_least_zero(s.material.cutting_resistance, "cutting resistance");
        if (tears) s.tearing.emplace();
    }
    if (!tears) return;
    a.number(s.tearing->strength);
    a.number(s.tearing->propagation_ratio);
}

template <class A>
void entry(A& a, BodyEntry& e) {
    BodySource source = e.source ? *e.source : BodySource{};
    mesh(a, source.model.mesh);
    attributes(a, source.model.attributes, source.model.mesh.triangles.size());
    body_settings(a, source.settings);
    if (A::loads) e.source = make_source(std::move(source.model), std::move(source.settings));
}

template <class A>
void region(A& a, Region& r) {
    auto kind = static_cast<std::uint8_t>(r.index());
    if (kind > 1)
        throw InputError("region", "is given by a function, which no file can hold",
                         "give boxes and spheres");
    a.number(kind);
    require_state(kind <= 1, "a region that there is not");
    if (A::loads && kind == 1) r = SphereRegion{};
    if (auto* box = std::get_if<BoxRegion>(&r)) {
        vector3(a, box->low);
        vector3(a, box->high);
    } else {
        vector3(a, std::get<SphereRegion>(r).centre);
        a.number(std::get<SphereRegion>(r).radius);
    }
}

template <class A>
void entry(A& a, HandleEntry& e) {
    id_of(a, e.body);
    a.text(e.name);
    region(a, e.region);
    for (double* value : {&e.stiffness, &e.limit, &e.from}) a.number(*value);
    require_state(e.stiffness > 0 && e.stiffness < 1e30 && e.limit > 0 && std::abs(e.from) < 1e30,
                  "a handle without a force");
    track(a, e.track);
}

template <class A>
void entry(A& a, ConstraintEntry& e) {
    id_of(a, e.body);
    region(a, e.region);
    a.number(e.from);
    require_state(std::abs(e.from) < 1e30, "a constraint without a time");
    track(a, e.track);
}

template <class A>
void shape(A& a, ShapeSource& s) {
    auto kind = static_cast<std::uint8_t>(s.index());
    a.number(kind);
    require_state(kind <= 3, "a shape that there is not");
    if (A::loads && kind == 1) s = SphereShape{};
    if (A::loads && kind == 2) s = BoxShape{};
    if (A::loads && kind == 3) s = std::make_shared<const geometry::TriangleMesh>();
    if (auto* half = std::get_if<HalfSpaceShape>(&s)) {
        vector3(a, half->normal);
        a.number(half->offset);
    } else if (auto* sphere = std::get_if<SphereShape>(&s)) {
        a.number(sphere->radius);
    } else if (auto* box = std::get_if<BoxShape>(&s)) {
        vector3(a, box->size);
        a.number(box->rounding);
    } else {
        auto& held = std::get<std::shared_ptr<const geometry::TriangleMesh>>(s);
        geometry::TriangleMesh copy = *held;
        mesh(a, copy);
        held = std::make_shared<const geometry::TriangleMesh>(std::move(copy));
    }
}

template <class A>
void entry(A& a, ColliderEntry& e) {
    a.text(e.name);
    a.number(e.friction);
    if (A::loads) require_at_least_zero(e.friction, "friction");
    shape(a, e.shape);
    track(a, e.track);
}

template <class A>
void entry(A& a, ToolEntry& e) {
    flag(a, e.lowered);
    e.cutting.resize(a.count(e.cutting.size(), 8));
    for (BodyId& id : e.cutting) id_of(a, id);
}

template <class A, class Tag, class T>
void list(A& a, SlotList<Tag, T>& things) {
    const std::size_t count = a.count(things.size(), 8);
    std::set<std::uint32_t> indices, generations;
    for (std::size_t k = 0; k < count; ++k) {
        Id<Tag> id = A::loads ? Id<Tag>{} : things.id_at(k);
        id_of(a, id);
        require_state(indices.insert(id.index).second && generations.insert(id.generation).second,
                      "an id of two things");
        T one = A::loads ? T{} : things.at(k);
        entry(a, one);
        if (A::loads) things.put(id, std::move(one));
    }
}

// Samples, shape and activity of a blade are all its state.
template <class A>
void blade(A& a, body::Tool& tool) {
    std::string name = tool.blade.name();
    cutting::BladeShape edges = tool.blade.shape();
    SampledMotion path = tool.blade.samples();
    double from = tool.blade.active_from(), until = tool.blade.active_until();
    a.text(name);
    edges.polylines.resize(a.count(edges.polylines.size(), 8));
    for (std::vector<Vec3>& line : edges.polylines) {
        line.resize(a.count(line.size(), sizeof(Vec3)));
        for (Vec3& p : line) vector3(a, p);
    }
    motion(a, path);
    a.number(from);
    a.number(until);
    if (!A::loads) return;
    tool.blade = cutting::Blade(name, std::move(edges), std::move(path));
    tool.blade.set_active(from, until);
}

body::Tool any_tool() {
    SampledMotion still;
    still.add(0, Isometry::Identity());
    return {
        cutting::Blade("", cutting::make_straight_blade(Vec3::Zero(), Vec3::UnitX()), still), {}, {}, {}, 0};
}

template <class A>
void tools(A& a, Snapshot& s) {
    const std::size_t count = a.count(s.tools.size(), 240);
    require_state(count == s.things.tools.size(), "tools without ids");
    s.tools.resize(count, any_tool());
    for (body::Tool& tool : s.tools) {
        blade(a, tool);
        a.number(tool.sides.reach);
        a.number(tool.sides.friction);
        if (A::loads) require_at_least_zero(tool.sides.reach, "side reach");
        if (A::loads) require_at_least_zero(tool.sides.friction, "side friction");
        numbers(a, tool.bodies);
        for (const std::size_t b : tool.bodies)
            require_state(b == body::removed_body || b < s.things.bodies.size(), "a tool of no body");
        a.number(tool.cut_number);
        require_state(tool.cut_number >= 0 && tool.cut_number < body::tear_cut_number,
                      "a cut without a number");
    }
    a.number(s.next_cut_number);
    require_state(s.next_cut_number >= 0 && s.next_cut_number <= body::tear_cut_number,
                  "a cut without a number");
}

template <class A>
void world_settings(A& a, body::WorldSettings& s) {
    for (double* value : {&s.time_step, &s.contact.friction, &s.solver.tolerance}) {
        a.number(*value);
        require_state(*value >= 0 && *value < 1e30, "a setting out of range");
    }
    require_state(s.time_step > 0 && s.solver.tolerance > 0, "a setting out of range");
    a.number(s.start_time);
    require_state(std::abs(s.start_time) < 1e30, "a setting out of range");
    vector3(a, s.gravity);
    bool has_ground = s.ground.has_value(),
         is_explicit = s.solver.kind == meshless::SolverKind::explicit_steps;
    flag(a, has_ground);
    flag(a, is_explicit);
    flag(a, s.contact.pieces);
    bool has_restitution = s.contact.restitution.has_value();
    flag(a, has_restitution);
    if (has_restitution) {
        double coefficient = s.contact.restitution.value_or(0);
        a.number(coefficient);
        require_state(coefficient >= 0 && coefficient <= 1, "a setting out of range");
        s.contact.restitution = coefficient;
    }
    a.number(s.solver.max_iterations);
    require_state(s.solver.max_iterations >= 1, "a setting out of range");
    if (A::loads && is_explicit) s.solver.kind = meshless::SolverKind::explicit_steps;
    auto scheme = static_cast<std::int32_t>(s.solver.scheme);
    a.number(scheme);
    require_state(scheme >= 0 && scheme <= static_cast<std::int32_t>(meshless::TimeScheme::tr_bdf2),
                  "an unknown integrator");
    s.solver.scheme = static_cast<meshless::TimeScheme>(scheme);
    if (!has_ground) return;
    if (A::loads) s.ground.emplace();
    vector3(a, s.ground->normal);
    a.number(s.ground->offset);
    a.number(s.ground->friction);
    require_state(std::abs(s.ground->normal.norm() - 1) < 1e-9 && std::abs(s.ground->offset) < 1e30 &&
                      s.ground->friction >= 0 && s.ground->friction < 1e30,
                  "a ground that is no plane");
}

template <class A>
void snapshot_of(A& a, Snapshot& s) {
    world_settings(a, s.settings);
    list(a, s.things.bodies);
    list(a, s.things.tools);
    list(a, s.things.handles);
    list(a, s.things.constraints);
    list(a, s.things.colliders);
    tools(a, s);
    a.text(s.state);
}

template <class List>
void require_bodies(const List& list, const Things& things) {
    for (std::size_t k = 0; k < list.size(); ++k) {
        bool there = false;
        for (std::size_t b = 0; b < things.bodies.size(); ++b)
            there |= things.bodies.id_at(b) == list.at(k).body;
        require_state(there, "a thing of no body");
        region_of(list.at(k).region, "region");
    }
}

}  // namespace

void archive_snapshot(SavingArchive& archive, Snapshot& snapshot) {
    snapshot_of(archive, snapshot);
}

void archive_snapshot(LoadingArchive& archive, Snapshot& snapshot) {
    snapshot_of(archive, snapshot);
}

void finish_loaded(Snapshot& snapshot, const Parallel& parallel) {
    require_bodies(snapshot.things.handles, snapshot.things);
    require_bodies(snapshot.things.constraints, snapshot.things);
    for (std::size_t k = 0; k < snapshot.things.colliders.size(); ++k) {
        ColliderEntry& collider = snapshot.things.colliders.at(k);
        collider.solid = make_solid(collider.shape, "collider '" + collider.name + "'", parallel);
    }
}

}  // namespace splitcubes::api
