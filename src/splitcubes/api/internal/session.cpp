#include <splitcubes/api/internal/convert.h>
#include <splitcubes/api/internal/session.h>
#include <splitcubes/api/internal/tuning.h>
#include <splitcubes/body/body.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/state_stream.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace splitcubes::api {

namespace {

std::function<Isometry(double)> motion_along(const Track& track) {
    return [track](double time) { return track->at(time); };
}

template <class List>
void own_tracks(List& list) {
    for (std::size_t k = 0; k < list.size(); ++k)
        list.at(k).track = std::make_shared<SampledMotion>(*list.at(k).track);
}

template <class List>
void forget_before(const List& list, double time) {
    for (std::size_t k = 0; k < list.size(); ++k) list.at(k).track->forget_before(time);
}

// Contacts name bodies and colliders by 16 bits.
void require_key(std::size_t count, const char* what) {
    constexpr std::size_t max_count = 65000;
    if (count >= max_count) throw InputError("simulation", std::string("has 65000 ") + what, "remove some");
}

// Removes all of a body.
template <class List>
void remove_of(List& list, BodyId body) {
    for (std::size_t k = list.size(); k-- > 0;)
        if (list.at(k).body == body) list.remove(list.id_at(k));
}

}  // namespace

std::shared_ptr<const BodySource> make_source(io::Model model, body::BodySettings settings) {
    std::shared_ptr<const geometry::AttributeTransfer> transfer;
    if (!model.attributes.empty()) {
        geometry::TriangleMesh placed = model.mesh;
        for (Vec3& p : placed.positions) p = settings.pose * p;
        transfer =
            std::make_shared<geometry::AttributeTransfer>(placed, model.attributes, 0.5 * settings.cell_size);
    }
    return std::make_shared<BodySource>(
        BodySource{std::move(model), std::move(settings), std::move(transfer)});
}

std::shared_ptr<const geometry::SignedDistance> make_solid(const ShapeSource& shape, const std::string& where,
                                                           const Parallel& parallel) {
    constexpr int cells = tuning::input::collider_cells;
    if (const auto* half = std::get_if<HalfSpaceShape>(&shape)) {
        const Vec3 normal = vector_of(half->normal, where + ", normal");
        if (!std::isfinite(half->offset)) throw InputError(where + ", offset", "is not finite");
        if (!(normal.stableNorm() > 0))
            throw InputError(where + ", normal", "has no direction", "give a vector other than zero");
        return geometry::make_plane_distance(normal.stableNormalized(), half->offset);
    }
    if (const auto* sphere = std::get_if<SphereShape>(&shape)) {
        require_above_zero(sphere->radius, where + ", radius");
        return geometry::make_sphere_distance(sphere->radius);
    }
    if (const auto* box = std::get_if<BoxShape>(&shape)) {
        require_at_least_zero(box->rounding, where + ", rounding");
        return geometry::make_box_distance(vector_of(box->size, where + ", size"), box->rounding);
    }
    return geometry::make_mesh_distance(*std::get<std::shared_ptr<const geometry::TriangleMesh>>(shape),
                                        cells, parallel);
}

Things Things::copy() const {
    Things out = *this;
    own_tracks(out.handles);
    own_tracks(out.constraints);
    own_tracks(out.colliders);
    return out;
}

void Things::continue_after(const Things& other) {
    bodies.continue_after(other.bodies);
    tools.continue_after(other.tools);
    handles.continue_after(other.handles);
    constraints.continue_after(other.constraints);
    colliders.continue_after(other.colliders);
}

Session::Session(const body::WorldSettings& settings, std::shared_ptr<const Parallel> parallel)
    : parallel_(std::move(parallel)), world_(std::make_unique<body::World>(settings, parallel_)) {}

Session::Session(const Snapshot& snapshot, std::shared_ptr<const Parallel> parallel)
    : parallel_(std::move(parallel)),
      world_(std::make_unique<body::World>(snapshot.settings, parallel_)),
      things_(snapshot.things.copy()) {
    for (std::size_t k = 0; k < things_.colliders.size(); ++k) make_collider(things_.colliders.at(k));
    for (std::size_t k = 0; k < things_.bodies.size(); ++k) make_body(things_.bodies.at(k));
    for (std::size_t k = 0; k < things_.handles.size(); ++k) make_handle(things_.handles.at(k));
    for (std::size_t k = 0; k < things_.constraints.size(); ++k) make_constraint(things_.constraints.at(k));
    for (const body::Tool& tool : snapshot.tools) {
        world_->set_next_cut_number(tool.cut_number);
        world_->add_tool(tool.blade, tool.bodies, tool.sides);
    }
    world_->set_next_cut_number(snapshot.next_cut_number);
    StateReader reader(snapshot.state);
    world_->load(reader);
    reader.finish();
    for (std::size_t b = 0; b < world_->bodies().size(); ++b)
        streams_[b] = std::make_unique<SurfaceStream>(*world_->bodies()[b],
                                                      things_.bodies.at(b).source->transfer, *parallel_);
}

Snapshot Session::snapshot() const {
    StateWriter writer;
    world_->save(writer);
    return {world_->settings(), things_.copy(), world_->tools(), world_->next_cut_number(), writer.take()};
}

void Session::make_body(const BodyEntry& entry) {
    world_->add_body(entry.source->model.mesh, entry.source->settings);
    try {
        streams_.push_back(
            std::make_unique<SurfaceStream>(*world_->bodies().back(), entry.source->transfer, *parallel_));
    } catch (...) {
        world_->remove_body(world_->bodies().size() - 1);
        throw;
    }
}

BodyId Session::add_body(BodyEntry entry) {
    require_key(things_.bodies.size(), "bodies");
    make_body(entry);
    return things_.bodies.add(std::move(entry));
}

void Session::remove_body(BodyId id) {
    const std::size_t position = things_.bodies.position(id);
    remove_of(things_.handles, id);
    remove_of(things_.constraints, id);
    for (std::size_t k = 0; k < things_.tools.size(); ++k) std::erase(things_.tools.at(k).cutting, id);
    world_->remove_body(position);
    streams_.erase(streams_.begin() + static_cast<std::ptrdiff_t>(position));
    things_.bodies.remove(id);
}

void Session::require_sample(BodyId id, const std::function<bool(const Vec3&)>& region,
                             const std::string& where) {
    const body::Body& of = body(id);
    if (!of.has_phyxel_in(region))
        throw InputError(where, "its region holds no elastic sample of body '" + of.name() + "'",
                         "make it larger, or the body of more samples");
}

void Session::make_handle(const HandleEntry& entry) {
    body::Handle out;
    out.name = entry.name;
    out.region = region_of(entry.region, "handle '" + entry.name + "', region");
    out.motion = motion_along(entry.track);
    out.stiffness = entry.stiffness;
    out.limit = std::min(entry.limit, 1e300);
    out.from = entry.from;
    body(entry.body).add_handle(std::move(out));
}

HandleId Session::add_handle(HandleEntry entry) {
    const std::string where = "handle '" + entry.name + "'";
    require_sample(entry.body, region_of(entry.region, where + ", region"), where);
    make_handle(entry);
    return things_.handles.add(std::move(entry));
}

void Session::remove_handle(HandleId id) {
    body(things_.handles[id].body).remove_handle(Things::index_in_body(things_.handles, id));
    things_.handles.remove(id);
}

void Session::make_constraint(const ConstraintEntry& entry) {
    body::HoldConstraint out;
    out.region = region_of(entry.region, "constraint, region");
    out.motion = motion_along(entry.track);
    out.from = entry.from;
    body(entry.body).add_constraint(std::move(out));
}

ConstraintId Session::add_constraint(ConstraintEntry entry) {
    require_sample(entry.body, region_of(entry.region, "constraint, region"), "constraint");
    make_constraint(entry);
    return things_.constraints.add(std::move(entry));
}

void Session::remove_constraint(ConstraintId id) {
    body(things_.constraints[id].body).remove_constraint(Things::index_in_body(things_.constraints, id));
    things_.constraints.remove(id);
}

void Session::make_collider(const ColliderEntry& entry) {
    world_->add_collider({entry.name, entry.solid, motion_along(entry.track), entry.friction});
}

ColliderId Session::add_collider(ColliderEntry entry) {
    require_key(things_.colliders.size(), "colliders");
    make_collider(entry);
    return things_.colliders.add(std::move(entry));
}

void Session::remove_collider(ColliderId id) {
    // The ground is the world's first.
    world_->remove_collider(things_.colliders.position(id) + (world_->settings().ground ? 1 : 0));
    things_.colliders.remove(id);
}

void Session::require_cut_number() const {
    if (world_->next_cut_number() >= body::tear_cut_number)
        throw Error(ErrorKind::failed,
                    "simulation: has had a million tools and cuts at rest; start another one");
}

void Session::update_surface(std::size_t position) {
    streams_[position]->forget_changes();
    streams_[position]->take_changes(*world_->bodies()[position], *parallel_);
    streams_[position]->move(*world_->bodies()[position], *parallel_);
}

void Session::update_surfaces() {
    for (std::size_t b = 0; b < streams_.size(); ++b) update_surface(b);
}

void Session::forget_past_poses() {
    world_->forget_tool_paths();
    forget_before(things_.handles, world_->time());
    forget_before(things_.constraints, world_->time());
    forget_before(things_.colliders, world_->time());
}

}  // namespace splitcubes::api
