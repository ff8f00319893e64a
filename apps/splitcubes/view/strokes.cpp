#include "strokes.h"

#include "vectors.h"

#include <algorithm>
#include <cmath>

namespace splitcubes::view {

namespace {

constexpr double closing_time = 0.2;    // s, that jaws take
constexpr double slip_share = 0.98;     // of the limit of the force, from which material slips
constexpr double slip_openings = 0.75;  // of the jaws, how far it has slid when it is out

// Motion of the anchor since the command was made.
Vec3 drift(const Command& command, const Simulation& simulation) {
    const std::vector<BodyId> bodies = simulation.bodies();
    if (!command.has_anchor || command.anchor.body >= bodies.size()) return Vec3::Zero();
    const std::optional<Vec3> now =
        present_position(command.anchor, simulation.surface(bodies[command.anchor.body]));
    return now ? Vec3(*now - command.anchor.world) : Vec3(Vec3::Zero());
}

Isometry shifted(const Isometry& frame, const Vec3& by) {
    Isometry out = frame;
    out.translation() += by;
    return out;
}

// A stroke touches the body and the piece at its anchor.
std::int32_t piece_at(const MaterialPoint& anchor, const SurfaceView& surface) {
    const std::uint32_t slot = anchor.vertices[0];
    return slot < surface.pieces.size() ? surface.pieces[slot] : -1;
}

StrokeSample sample_of(double time, const Isometry& world, const Simulation& simulation, std::size_t body,
                       std::int32_t piece) {
    const std::vector<BodyId> bodies = simulation.bodies();
    if (body >= bodies.size()) return {time, world, world};
    return {time, world, fitted_motion(simulation.surface(bodies[body]), piece).inverse() * world};
}

template <class Name>
bool is_listed(const Name& id, const std::vector<Name>& list) {
    return std::find(list.begin(), list.end(), id) != list.end();
}

}  // namespace

void Strokes::begin(const Command& command, Simulation& simulation, StrokeLog& log) {
    if (command.frames.empty() || command.points.size() < 2) return;
    const Vec3 by = drift(command, simulation);
    Stroke stroke;
    stroke.points = command.points;
    stroke.now = shifted(command.frames.front(), by);
    for (std::size_t k = 1; k < command.frames.size(); ++k)
        stroke.frames.push_back(shifted(command.frames[k], by));
    stroke.frames_per_step = command.frames_per_step;
    stroke.ends = command.frames_per_step > 0;
    std::vector<Vector3> points;
    for (const Vec3& p : command.points) points.push_back(to_public(p));
    stroke.tool = simulation.add_tool({points}, {.name = "viewer", .pose = to_public(stroke.now)});
    simulation.lower_tool(stroke.tool);
    if (command.has_anchor && command.anchor.body < simulation.bodies().size()) {
        stroke.body = command.anchor.body;
        stroke.piece = piece_at(command.anchor, simulation.surface(simulation.bodies()[stroke.body]));
    }
    stroke.logged =
        log.begin_stroke({stroke.body,
                          command.points,
                          {sample_of(simulation.time(), stroke.now, simulation, stroke.body, stroke.piece)}});
    if (const auto old = strokes_.find(command.slot); old != strokes_.end())
        simulation.remove_tool(old->second.tool);
    strokes_[command.slot] = std::move(stroke);
}

void Strokes::move(const Command& command, const Simulation& simulation) {
    const auto it = strokes_.find(command.slot);
    if (it == strokes_.end() || it->second.ends) return;
    const Vec3 by = drift(command, simulation);
    for (const Isometry& frame : command.frames) it->second.frames.push_back(shifted(frame, by));
    if (!command.has_anchor || command.anchor.body >= simulation.bodies().size()) return;
    it->second.body = command.anchor.body;
    it->second.piece = piece_at(command.anchor, simulation.surface(simulation.bodies()[command.anchor.body]));
}

void Strokes::end(int slot) {
    if (const auto it = strokes_.find(slot); it != strokes_.end()) it->second.ends = true;
}

void Strokes::before_step(Simulation& simulation, StrokeLog& log) {
    const std::vector<BodyId> bodies = simulation.bodies();
    for (auto& [slot, stroke] : strokes_) {
        std::size_t count = stroke.frames.size();
        if (stroke.frames_per_step > 0)
            count = std::min(count, static_cast<std::size_t>(stroke.frames_per_step));
        if (count == 0) continue;
        Isometry rest_from_world = Isometry::Identity();
        if (stroke.body < bodies.size())
            rest_from_world = fitted_motion(simulation.surface(bodies[stroke.body]), stroke.piece).inverse();
        for (std::size_t k = 0; k < count; ++k) {
            const double share = static_cast<double>(k + 1) / static_cast<double>(count);
            stroke.now = stroke.frames.front();
            stroke.frames.pop_front();
            const double time = simulation.time() + share * simulation.time_step();
            log.move_stroke(stroke.logged, {time, stroke.now, rest_from_world * stroke.now},
                            simulation.time());
            simulation.add_tool_pose(stroke.tool, time, to_public(stroke.now));
        }
    }
}

void Strokes::take_forces(const StepResult& result) {
    for (auto& [slot, stroke] : strokes_)
        for (const ToolResult& tool : result.tools)
            if (tool.tool == stroke.tool) stroke.force = to_eigen(tool.force);
}

void Strokes::append_forces(std::vector<ForceState>& out) const {
    for (const auto& [slot, stroke] : strokes_)
        if (stroke.force.norm() > 0) out.push_back({stroke.now.translation(), stroke.force});
}

void Strokes::after_step(Simulation& simulation, StrokeLog& log) {
    for (auto it = strokes_.begin(); it != strokes_.end();) {
        Stroke& stroke = it->second;
        if (stroke.ends && stroke.frames.empty()) {
            // The next step cuts along the way of this one.
            if (--stroke.steps_left == 1) {
                simulation.raise_tool(stroke.tool);
                log.end_stroke(stroke.logged, simulation.time());
            }
            if (stroke.steps_left == 0) {
                simulation.remove_tool(stroke.tool);
                it = strokes_.erase(it);
                continue;
            }
        }
        ++it;
    }
}

void Strokes::append_blades(std::vector<std::vector<Vec3>>& out) const {
    for (const auto& [slot, stroke] : strokes_) {
        out.emplace_back();
        for (const Vec3& p : stroke.points) out.back().push_back(stroke.now * p);
    }
}

Isometry Pulls::Pull::pose() const {
    Isometry out = Isometry::Identity();
    out.linear() = rotation;
    out.translation() = target - rotation * point.rest;
    if (jaw.partner != 0) out.translation() += jaw.closed * jaw.closing;
    return out;
}

double Pulls::Pull::opening(double closed) const {
    const Vec3 from_middle = rotation * jaw.offset + closed * jaw.closing;
    return 2 * std::abs(from_middle.dot(jaw.frame.linear().col(0)));
}

void Pulls::begin(const Command& command, BodyId body, Simulation& simulation, StrokeLog& log) {
    if (command.frames.empty()) return;
    if (command.partner != 0 && (command.frames.size() < 2 || command.points.size() < 2)) return;
    let_go(command.slot, simulation, log);
    Pull pull;
    if (command.partner != 0) {
        pull.jaw = {.partner = command.partner,
                    .limit = command.limit,
                    .offset = command.points[0],
                    .closing = command.points[1],
                    .closed = 0,
                    .frame = command.frames[1]};
        pull.moved = true;
    }
    pull.body = body;
    pull.point = command.anchor;
    pull.rotation = command.frames.front().linear();
    pull.at = present_position(command.anchor, simulation.surface(body)).value_or(command.anchor.world);
    pull.target = pull.at;
    if (pull.jaw.limit > 0)
        pull.jaw.reach = 2 * pull.jaw.limit / command.value + slip_openings * pull.opening(0);
    const Isometry pose = pull.pose();
    const Vec3 centre = pull.point.rest + pull.jaw.offset;
    HandleSettings settings{.name = "viewer",
                            .region = SphereRegion{to_public(centre), command.radius},
                            .pose = to_public(pose),
                            .stiffness = command.value};
    if (command.limit > 0) settings.force_limit = command.limit;
    pull.handle = simulation.add_handle(body, settings);
    pull.logged = log.begin_pull({command.anchor.body,
                                  centre,
                                  command.radius,
                                  command.value,
                                  command.limit,
                                  {{simulation.time(), pose, Isometry::Identity()}}});
    pulls_[command.slot] = pull;
}

Pulls::Pull* Pulls::partner_of(const Pull& pull) {
    const auto it = pull.jaw.partner != 0 ? pulls_.find(pull.jaw.partner) : pulls_.end();
    return it == pulls_.end() ? nullptr : &it->second;
}

void Pulls::move(int slot, const Vec3& target) {
    const auto it = pulls_.find(slot);
    if (it == pulls_.end()) return;
    for (Pull* pull : {&it->second, partner_of(it->second)}) {
        if (pull == nullptr) continue;
        pull->target = target;
        pull->moved = true;
    }
}

void Pulls::end(int slot, Simulation& simulation, StrokeLog& log) {
    const auto it = pulls_.find(slot);
    if (it == pulls_.end()) return;
    const int partner = it->second.jaw.partner;
    let_go(slot, simulation, log);
    if (partner != 0) let_go(partner, simulation, log);
}

void Pulls::let_go(int slot, Simulation& simulation, StrokeLog& log) {
    const auto it = pulls_.find(slot);
    if (it == pulls_.end()) return;
    log.end_pull(it->second.logged, simulation.time());
    simulation.remove_handle(it->second.handle);
    pulls_.erase(it);
}

void Pulls::set_pinned(int slot) {
    const auto it = pulls_.find(slot);
    if (it == pulls_.end()) return;
    it->second.pinned = true;
    if (Pull* partner = partner_of(it->second)) partner->pinned = true;
}

void Pulls::before_step(Simulation& simulation, StrokeLog& log) {
    for (auto& [slot, pull] : pulls_) {
        if (!pull.moved) continue;
        pull.jaw.closed = std::min(1.0, pull.jaw.closed + simulation.time_step() / closing_time);
        pull.moved = pull.jaw.closed < 1;
        const Isometry pose = pull.pose();
        const double time = simulation.time() + simulation.time_step();
        log.move_pull(pull.logged, {time, pose, Isometry::Identity()}, simulation.time());
        simulation.add_handle_pose(pull.handle, time, to_public(pose));
    }
}

bool Pulls::slips(Simulation& simulation, StrokeLog& log) {
    for (const auto& [slot, pull] : pulls_) {
        if (!(pull.jaw.limit > 0) || pull.force.norm() < slip_share * pull.jaw.limit) continue;
        const std::optional<Vec3> at = present_position(pull.point, simulation.surface(pull.body));
        if (!at || (pull.target - *at).norm() < pull.jaw.reach) continue;
        end(slot, simulation, log);
        return true;
    }
    return false;
}

void Pulls::after_travel(Simulation& simulation, StrokeLog& log) {
    const std::vector<HandleId> present = simulation.handles();
    for (auto it = pulls_.begin(); it != pulls_.end();) {
        const bool there = is_listed(it->second.handle, present);
        if (there && it->second.pinned) {
            log.end_pull(it->second.logged, std::numeric_limits<double>::infinity());
            ++it;
            continue;
        }
        if (there) simulation.remove_handle(it->second.handle);
        it = pulls_.erase(it);
    }
}

void Pulls::become(const Pulls& left) {
    std::map<int, Pull> next;
    for (const auto& [slot, pull] : left.pulls_) {
        const auto own = pulls_.find(slot);
        if (own == pulls_.end()) continue;
        Pull& one = next[slot] = pull;
        // What was made again has names of its own.
        one.handle = own->second.handle;
        one.body = own->second.body;
        one.logged = own->second.logged;
    }
    pulls_ = std::move(next);
}

bool Pulls::is_idle() const {
    return std::all_of(pulls_.begin(), pulls_.end(), [](const auto& one) { return one.second.pinned; });
}

bool Pulls::owns(HandleId handle) const {
    return std::any_of(pulls_.begin(), pulls_.end(),
                       [&](const auto& one) { return one.second.handle == handle; });
}

void Pulls::take_forces(const StepResult& result) {
    for (auto& [slot, pull] : pulls_)
        for (const HandleResult& force : result.handles)
            if (force.handle == pull.handle) pull.force = to_eigen(force.force);
}

// Jaws are one thing: what they squeeze with is no force on the whole.
void Pulls::append_forces(std::vector<ForceState>& out) const {
    const auto strains = [](const Pull& pull) {
        return pull.jaw.limit > 0 && pull.force.norm() > slip_share * pull.jaw.limit;
    };
    for (const auto& [slot, pull] : pulls_) {
        const auto other = pull.jaw.partner != 0 ? pulls_.find(pull.jaw.partner) : pulls_.end();
        if (other != pulls_.end() && other->first < slot) continue;
        ForceState force{pull.at, pull.force, strains(pull)};
        if (other != pulls_.end()) {
            force.force += other->second.force;
            force.is_at_limit = force.is_at_limit || strains(other->second);
        }
        if (force.force.norm() > 0) out.push_back(force);
    }
}

double Pulls::total_force() const {
    double out = 0;
    for (const auto& [slot, pull] : pulls_) out += pull.force.norm();
    return out;
}

void Pulls::append_states(const Simulation& simulation, std::vector<PullState>& out) {
    for (auto& [slot, pull] : pulls_) {
        pull.at = present_position(pull.point, simulation.surface(pull.body)).value_or(pull.target);
        PullState state{slot, pull.pinned, pull.at, pull.target, pull.force.norm()};
        if (pull.jaw.partner != 0) {
            state.partner = pull.jaw.partner;
            state.limit = pull.jaw.limit;
            state.frame = pull.jaw.frame;
            state.frame.translation() = pull.target;
            state.width = pull.opening(0);
            state.opening = pull.opening(pull.jaw.closed);
        }
        out.push_back(state);
    }
}

}  // namespace splitcubes::view
