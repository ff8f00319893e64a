#include <splitcubes/api/internal/convert.h>
#include <splitcubes/api/internal/history.h>
#include <splitcubes/api/internal/session.h>
#include <splitcubes/api/internal/simulation_impl.h>
#include <splitcubes/api/internal/state_file.h>
#include <splitcubes/api/internal/step_events.h>
#include <splitcubes/body/body.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/write_mesh.h>
#include <splitcubes/splitting/extract.h>

#include <limits>
#include <type_traits>
#include <utility>

namespace splitcubes {

using namespace api;

namespace {

// Throws unless a pose may be added to a path; makes what has stood still until now stand still.
template <class Add>
void add_pose(double now, double last, const Isometry& last_frame, double time, const Add& add) {
    if (!(time > now) || !(time > last))
        throw Error(ErrorKind::pose_not_later, "pose: its time (" + plain_number(time, 9) +
                                                   " s) is not later than " +
                                                   (last > now ? "the last pose (" + plain_number(last, 9)
                                                               : "the simulation (" + plain_number(now, 9)) +
                                                   " s)");
    if (!(time <= std::numeric_limits<double>::max()))
        throw Error(ErrorKind::invalid_argument, "pose: its time is not finite");
    if (last < now) add(now, last_frame);
}

void add_track_pose(SampledMotion& track, double now, double time, const Pose& pose) {
    const Isometry frame = isometry_of(pose, "pose");
    add_pose(now, track.times().back(), track.frames().back(), time,
             [&](double t, const Isometry& f) { track.add(t, f); });
    track.add(time, frame);
}

Track track_from(double time, const Pose& pose, const std::string& where) {
    auto track = std::make_shared<SampledMotion>();
    track->add(time, isometry_of(pose, where));
    return track;
}

bool any_lowered(const Session& session) {
    for (std::size_t k = 0; k < session.things().tools.size(); ++k)
        if (session.things().tools.at(k).lowered) return true;
    return false;
}

// Errors of the mesh name the body.
BodyId add_model(Session& session, io::Model model, const BodySettings& settings) {
    const std::string where = "body '" + settings.name + "'";
    try {
        body::BodySettings made = place_body(model, settings);
        return session.add_body({make_source(std::move(model), std::move(made))});
    } catch (const InputError& error) {
        const std::string text = error.what();
        throw Error(ErrorKind::invalid_argument, text.starts_with(where) ? text : where + ", " + text);
    }
}

void require_file_name(const std::string& file) {
    if (file.empty()) throw Error(ErrorKind::invalid_argument, "file: its name is empty");
}

template <class List>
std::size_t track_bytes(const List& list) {
    std::size_t count = 0;
    for (std::size_t k = 0; k < list.size(); ++k) count += list.at(k).track->times().capacity();
    return count * (sizeof(double) + sizeof(Isometry));
}

geometry::SurfaceMesh surface_of(const Session& session, BodyId id) {
    geometry::SurfaceMesh out = session.body(id).surface_mesh();
    const auto& source = session.things().bodies[id].source;
    if (source->transfer) out.attributes = source->transfer->onto(out, session.parallel());
    return out;
}

}  // namespace

Simulation::Impl::Impl(const SimulationSettings& settings)
    : session_(std::make_unique<Session>(world_settings_of(settings),
                                         std::make_shared<const Parallel>(settings.thread_count))),
      history_(std::make_unique<History>(settings.history)),
      events_(std::make_unique<StepEvents>()) {}

Simulation::Impl::~Impl() = default;

void Simulation::Impl::mark() {
    history_->mark(session_->snapshot());
}

void Simulation::Impl::mark_cut() {
    if (history_->is_automatic()) mark();
}

// A file's bodies can be none that there can be.
Session Simulation::Impl::session_of(const Snapshot& read, const std::string& file) const {
    try {
        return {read, session_->shared_parallel()};
    } catch (const InputError& error) {
        throw Error(ErrorKind::bad_file, file + ": is damaged: " + error.what());
    }
}

StepResult Simulation::Impl::step() {
    return write([&](Session& session) {
        events_->begin(session);
        return whole([&] {
            const body::StepReport report = session.world().step();
            StepResult out = events_->end(session, report);
            session.update_surfaces();
            session.forget_past_poses();
            return out;
        });
    });
}

void Simulation::Impl::become(Session next) {
    next.things().continue_after(session_->things());
    *session_ = std::move(next);
    broken_ = false;
}

bool Simulation::Impl::go(bool back) {
    return run_call(gate_, true, [&] {
        const std::optional<Snapshot> to = history_->peek(back);
        if (!to) return false;
        Session next(*to, session_->shared_parallel());
        Snapshot now = broken_ ? *to : session_->snapshot();
        history_->moved(back, std::move(now));
        become(std::move(next));
        return true;
    });
}

void Simulation::Impl::load(const std::string& file) {
    run_call(gate_, true, [&] {
        require_file_name(file);
        const Snapshot read = read_state_file(file, session_->parallel());
        Session next = session_of(read, file);
        become(std::move(next));
        history_->clear();
    });
}

Simulation::Simulation(const SimulationSettings& settings) {
    Gate gate;
    impl_ = run_call(gate, true, [&] { return std::make_unique<Impl>(settings); });
}
Simulation::~Simulation() = default;

Simulation::Impl& Simulation::impl() const {
    if (!impl_)
        throw Error(ErrorKind::invalid_argument, "simulation: has been moved from; assign one to it first");
    return *impl_;
}

Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

double Simulation::time() const {
    return impl().read([](const Session& s) { return s.world().time(); });
}
double Simulation::time_step() const {
    return impl().read([](const Session& s) { return s.world().settings().time_step; });
}

// --- bodies ---

BodyId Simulation::add_body(const MeshView& mesh, const BodySettings& settings) {
    return impl().write(
        [&](Session& s) { return add_model(s, model_of(mesh, "body '" + settings.name + "'"), settings); });
}

BodyId Simulation::add_body(const std::string& mesh_file, const BodySettings& settings) {
    return impl().write([&](Session& s) {
        require_file_name(mesh_file);
        io::Model model;
        try {
            model = io::read_model(mesh_file);
        } catch (const InputError& error) {
            throw Error(ErrorKind::bad_file, error.what());
        }
        return add_model(s, std::move(model), settings);
    });
}

void Simulation::remove_body(BodyId body) {
    impl().write([&](Session& s) { s.remove_body(body); });
}

std::vector<BodyId> Simulation::bodies() const {
    return impl().read([](const Session& s) { return s.things().bodies.ids(); });
}

std::size_t Simulation::piece_count(BodyId body) const {
    return impl().read([&](const Session& s) { return s.body(body).pieces().count(); });
}

std::vector<std::string> Simulation::material_names(BodyId body) const {
    return impl().read(
        [&](const Session& s) { return s.stream(s.things().bodies.position(body)).material_names(); });
}

SurfaceView Simulation::surface(BodyId body) const {
    return impl().read([&](const Session& s) { return s.stream(s.things().bodies.position(body)).view(); });
}

void Simulation::write_surface(BodyId body, const std::string& file, int piece) const {
    impl().read([&](const Session& s) {
        const geometry::SurfaceMesh whole = surface_of(s, body);
        if (piece >= 0 && static_cast<std::size_t>(piece) >= s.body(body).pieces().count())
            throw InputError("piece",
                             std::to_string(piece) + " of " + std::to_string(s.body(body).pieces().count()),
                             "they are numbered from 0");
        io::write_mesh(file, piece < 0 ? whole : splitting::extract_piece(whole, piece));
    });
}

std::size_t Simulation::cut_with_sheet(BodyId body, const MeshView& sheet) {
    return impl().write([&](Session& s) {
        const std::size_t position = s.things().bodies.position(body);
        s.require_cut_number();
        const geometry::TriangleMesh mesh = mesh_of(sheet, "sheet");
        if (!any_lowered(s)) impl().mark_cut();
        return impl().whole([&] {
            const std::size_t count =
                s.body(body).cut_with_sheet(mesh, s.world().take_cut_number(), s.parallel());
            s.update_surface(position);
            return count;
        });
    });
}

std::size_t Simulation::cut_with_blade(BodyId body, const BladeView& blade, std::span<const TimedPose> path) {
    return impl().write([&](Session& s) {
        const std::size_t position = s.things().bodies.position(body);
        s.require_cut_number();
        if (path.data() == nullptr || path.size() < 2)
            throw InputError("path", "has " + std::to_string(path.size()) + " poses", "give two or more");
        SampledMotion motion;
        for (const TimedPose& at : path) {
            if (!motion.empty() && !(at.time > motion.times().back()))
                throw Error(ErrorKind::pose_not_later,
                            "path: its times do not increase; order the poses by time");
            motion.add(at.time, isometry_of(at.pose, "path, pose"));
        }
        cutting::Blade swept("blade", blade_shape_of(blade, "blade"), motion);
        swept.set_active(motion.times().front(), motion.times().back());
        if (!any_lowered(s)) impl().mark_cut();
        return impl().whole([&] {
            const std::size_t count =
                s.body(body).cut_with_blade(swept, s.world().take_cut_number(), s.parallel());
            s.update_surface(position);
            return count;
        });
    });
}

// --- tools ---

ToolId Simulation::add_tool(const BladeView& blade, const ToolSettings& settings) {
    return impl().write([&](Session& s) {
        const std::string where = "tool '" + settings.name + "'";
        s.require_cut_number();
        require_at_least_zero(settings.side_reach, where + ", side reach");
        require_at_least_zero(settings.side_friction, where + ", side friction");
        std::vector<std::size_t> bodies;
        for (const BodyId id : settings.bodies) bodies.push_back(s.things().bodies.position(id));
        SampledMotion path;
        path.add(s.world().time(), isometry_of(settings.pose, where + ", pose"));
        cutting::Blade made(settings.name, blade_shape_of(blade, where), path);
        constexpr double never = -std::numeric_limits<double>::infinity();
        made.set_active(never, never);
        s.world().add_tool(std::move(made), std::move(bodies), {settings.side_reach, settings.side_friction});
        return s.things().tools.add({});
    });
}

void Simulation::add_tool_pose(ToolId tool, double time, const Pose& pose) {
    impl().write([&](Session& s) {
        const std::size_t k = s.things().tools.position(tool);
        const Isometry frame = isometry_of(pose, "pose");
        const SampledMotion& path = s.world().tools()[k].blade.samples();
        add_pose(s.world().time(), path.times().back(), Isometry(path.frames().back()), time,
                 [&](double t, const Isometry& f) { s.world().move_tool(k, t, f); });
        s.world().move_tool(k, time, frame);
    });
}

void Simulation::lower_tool(ToolId tool) {
    impl().write([&](Session& s) {
        const std::size_t k = s.things().tools.position(tool);
        if (s.things().tools.at(k).lowered) return;
        if (!any_lowered(s)) impl().mark_cut();
        // One that was raised just now has not been raised at all.
        const cutting::Blade& blade = s.world().tools()[k].blade;
        const double now = s.world().time();
        const double from = blade.active_until() == now ? blade.active_from() : now;
        s.world().set_tool_active(k, from, std::numeric_limits<double>::infinity());
        s.things().tools.at(k).lowered = true;
    });
}

void Simulation::raise_tool(ToolId tool) {
    impl().write([&](Session& s) {
        const std::size_t k = s.things().tools.position(tool);
        if (!s.things().tools.at(k).lowered) return;
        s.world().set_tool_active(k, s.world().tools()[k].blade.active_from(), s.world().time());
        s.things().tools.at(k).lowered = false;
    });
}

bool Simulation::is_lowered(ToolId tool) const {
    return impl().read([&](const Session& s) { return s.things().tools[tool].lowered; });
}

void Simulation::remove_tool(ToolId tool) {
    impl().write([&](Session& s) {
        s.world().remove_tool(s.things().tools.position(tool));
        s.things().tools.remove(tool);
    });
}

std::vector<ToolId> Simulation::tools() const {
    return impl().read([](const Session& s) { return s.things().tools.ids(); });
}

// --- handles, constraints, colliders ---

HandleId Simulation::add_handle(BodyId body, const HandleSettings& settings) {
    return impl().write([&](Session& s) {
        const std::string where = "handle '" + settings.name + "'";
        s.things().bodies.position(body);
        require_above_zero(settings.stiffness, where + ", stiffness");
        if (!(settings.force_limit > 0)) throw InputError(where + ", force limit", "must be above zero");
        return s.add_handle({body, settings.name, settings.region, settings.stiffness, settings.force_limit,
                             s.world().time(),
                             track_from(s.world().time(), settings.pose, where + ", pose")});
    });
}

void Simulation::add_handle_pose(HandleId handle, double time, const Pose& pose) {
    impl().write(
        [&](Session& s) { add_track_pose(*s.things().handles[handle].track, s.world().time(), time, pose); });
}

void Simulation::remove_handle(HandleId handle) {
    impl().write([&](Session& s) { s.remove_handle(handle); });
}

ConstraintId Simulation::add_constraint(BodyId body, const ConstraintSettings& settings) {
    return impl().write([&](Session& s) {
        s.things().bodies.position(body);
        return s.add_constraint({body, settings.region, s.world().time(),
                                 track_from(s.world().time(), settings.pose, "constraint, pose")});
    });
}

void Simulation::add_constraint_pose(ConstraintId constraint, double time, const Pose& pose) {
    impl().write([&](Session& s) {
        add_track_pose(*s.things().constraints[constraint].track, s.world().time(), time, pose);
    });
}

void Simulation::remove_constraint(ConstraintId constraint) {
    impl().write([&](Session& s) { s.remove_constraint(constraint); });
}

ColliderId Simulation::add_collider(const ColliderSettings& settings) {
    return impl().write([&](Session& s) {
        const std::string where = "collider '" + settings.name + "'";
        require_at_least_zero(settings.friction, where + ", friction");
        const ShapeSource shape = std::visit(
            [&](const auto& one) -> ShapeSource {
                if constexpr (std::is_same_v<std::decay_t<decltype(one)>, MeshView>)
                    return std::make_shared<const geometry::TriangleMesh>(mesh_of(one, where));
                else
                    return one;
            },
            settings.shape);
        return s.add_collider({settings.name, settings.friction, shape,
                               make_solid(shape, where, s.parallel()),
                               track_from(s.world().time(), settings.pose, where + ", pose")});
    });
}

void Simulation::add_collider_pose(ColliderId collider, double time, const Pose& pose) {
    impl().write([&](Session& s) {
        add_track_pose(*s.things().colliders[collider].track, s.world().time(), time, pose);
    });
}

void Simulation::remove_collider(ColliderId collider) {
    impl().write([&](Session& s) { s.remove_collider(collider); });
}

std::vector<HandleId> Simulation::handles() const {
    return impl().read([](const Session& s) { return s.things().handles.ids(); });
}

std::vector<ConstraintId> Simulation::constraints() const {
    return impl().read([](const Session& s) { return s.things().constraints.ids(); });
}

std::vector<ColliderId> Simulation::colliders() const {
    return impl().read([](const Session& s) { return s.things().colliders.ids(); });
}

// --- time and state ---

StepResult Simulation::step() {
    return impl().step();
}

std::uint64_t Simulation::state_hash() const {
    return impl().read([](const Session& s) { return s.world().state_hash().value(); });
}

void Simulation::mark_undo_point() {
    impl().write([&](Session&) { impl().mark(); });
}

bool Simulation::undo() {
    return impl().go(true);
}

bool Simulation::redo() {
    return impl().go(false);
}

std::size_t Simulation::undo_count() const {
    return impl().history([](const History& h) { return h.count(true); });
}

std::size_t Simulation::redo_count() const {
    return impl().history([](const History& h) { return h.count(false); });
}

void Simulation::save(const std::string& file) const {
    impl().read([&](const Session& s) {
        require_file_name(file);
        write_state_file(file, s.snapshot());
    });
}

void Simulation::load(const std::string& file) {
    impl().load(file);
}

MemoryUse Simulation::memory_use() const {
    MemoryUse out;
    impl().read([&](const Session& s) {
        for (std::size_t b = 0; b < s.things().bodies.size(); ++b) out.surfaces += s.stream(b).bytes();
        for (const body::Tool& tool : s.world().tools())
            out.motion_samples +=
                tool.blade.samples().times().capacity() * (sizeof(double) + sizeof(Isometry));
        out.motion_samples += track_bytes(s.things().handles) + track_bytes(s.things().constraints) +
                              track_bytes(s.things().colliders);
    });
    impl().history([&](const History& h) {
        out.history_memory = h.memory();
        out.history_disk = h.disk();
    });
    return out;
}

}  // namespace splitcubes
