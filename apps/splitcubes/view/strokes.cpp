#include "strokes.h"

#include "vectors.h"

#include <algorithm>

namespace splitcubes::view {

namespace {

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

void Pulls::begin(const Command& command, BodyId body, Simulation& simulation, StrokeLog& log) {
    if (command.frames.empty()) return;
    end(command.slot, simulation, log);
    Pull pull;
    pull.body = body;
    pull.point = command.anchor;
    pull.rotation = command.frames.front().linear();
    pull.at = present_position(command.anchor, simulation.surface(body)).value_or(command.anchor.world);
    pull.target = pull.at;
    Isometry pose = Isometry::Identity();
    pose.linear() = pull.rotation;
    pose.translation() = pull.target - pull.rotation * pull.point.rest;
    pull.handle =
        simulation.add_handle(body, {.name = "viewer",
                                     .region = SphereRegion{to_public(pull.point.rest), command.radius},
                                     .pose = to_public(pose),
                                     .stiffness = command.value});
    pull.logged = log.begin_pull({command.anchor.body,
                                  pull.point.rest,
                                  command.radius,
                                  command.value,
                                  {{simulation.time(), pose, Isometry::Identity()}}});
    pulls_[command.slot] = pull;
}

void Pulls::move(int slot, const Vec3& target) {
    const auto it = pulls_.find(slot);
    if (it == pulls_.end()) return;
    it->second.target = target;
    it->second.moved = true;
}

void Pulls::end(int slot, Simulation& simulation, StrokeLog& log) {
    const auto it = pulls_.find(slot);
    if (it == pulls_.end()) return;
    log.end_pull(it->second.logged, simulation.time());
    simulation.remove_handle(it->second.handle);
    pulls_.erase(it);
}

void Pulls::set_pinned(int slot) {
    if (const auto it = pulls_.find(slot); it != pulls_.end()) it->second.pinned = true;
}

void Pulls::before_step(Simulation& simulation, StrokeLog& log) {
    for (auto& [slot, pull] : pulls_) {
        if (!pull.moved) continue;
        pull.moved = false;
        Isometry pose = Isometry::Identity();
        pose.linear() = pull.rotation;
        pose.translation() = pull.target - pull.rotation * pull.point.rest;
        const double time = simulation.time() + simulation.time_step();
        log.move_pull(pull.logged, {time, pose, Isometry::Identity()}, simulation.time());
        simulation.add_handle_pose(pull.handle, time, to_public(pose));
    }
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

void Pulls::append_forces(std::vector<ForceState>& out) const {
    for (const auto& [slot, pull] : pulls_)
        if (pull.force.norm() > 0) out.push_back({pull.at, pull.force});
}

double Pulls::total_force() const {
    double out = 0;
    for (const auto& [slot, pull] : pulls_) out += pull.force.norm();
    return out;
}

void Pulls::append_states(const Simulation& simulation, std::vector<PullState>& out) {
    for (auto& [slot, pull] : pulls_) {
        pull.at = present_position(pull.point, simulation.surface(pull.body)).value_or(pull.target);
        out.push_back({slot, pull.pinned, pull.at, pull.target, pull.force.norm()});
    }
}

}  // namespace splitcubes::view
