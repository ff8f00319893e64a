#include <splitcubes/core/error.h>
#include <splitcubes/cutting/sweep.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/course.h>
#include <splitcubes/scene/instrument.h>
#include <splitcubes/scene/motion.h>
#include <splitcubes/scene/strength.h>
#include <splitcubes/scene/tuning.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace splitcubes::scene {

namespace {

using tuning::course::same_time;

template <class Named>
std::size_t index_of_name(const std::vector<Named>& things, const std::string& name) {
    std::size_t k = 0;
    while (k < things.size() && things[k].name != name) ++k;
    if (k == things.size()) throw InputError("scene", "there is no '" + name + "'");
    return k;
}

bool carrier_is_prescribed(const SceneDescription& scene, const Carrier& carrier) {
    if (carrier.kind == CarrierKind::tool)
        return is_prescribed(scene.tools[index_of_name(scene.tools, carrier.name)]);
    return carrier.kind == CarrierKind::collider &&
           is_prescribed(scene.colliders[index_of_name(scene.colliders, carrier.name)]);
}

// Time of a thing's own keyframes. One that waits stands at its first one, one that has ended where it was.
double own_time(const std::optional<double>& started, const std::optional<double>& ended, bool waits,
                double time) {
    if (waits && !started) return 0;
    const double at = ended && time > *ended + same_time ? *ended : time;
    if (!waits) return at;
    return at > *started + same_time ? at - *started : 0;
}

Course::Interval shifted(double from, std::optional<double> until, double by,
                         const std::optional<double>& ended) {
    Course::Interval out = {from + by, until ? *until + by : Course::never};
    if (ended) out.second = std::min(out.second, *ended);
    out.first = std::min(out.first, out.second);
    return out;
}

}  // namespace

struct Course::Link {
    CarrierKind kind;
    std::size_t index;  // of the tool, the collider, or the material frame
    bool is_prescribed;
};

struct Course::Plan {
    const SceneDescription* scene;
    bool depends_on_state = false, takes_over = false;
    std::vector<cutting::Blade> blades;
    std::vector<std::optional<Link>> tool_carriers, collider_carriers, constraint_carriers, handle_carriers;
    std::vector<std::pair<std::size_t, MaterialFrame>> frames;  // number of the body
    // Regions of those that start in the middle of a run, with the numbers of their bodies.
    std::vector<std::optional<std::pair<std::size_t, MaterialFrame>>> constraint_regions, handle_regions;

    Plan(const SceneDescription& of, Bodies at_start) : scene(&of) {
        for (const ToolDescription& tool : of.tools) {
            blades.push_back(make_blade(tool));
            tool_carriers.push_back(link(tool.relative_to, "tool '" + tool.name + "'", at_start));
            depends_on_state |= !is_prescribed(tool);
        }
        for (const ColliderDescription& one : of.colliders) {
            collider_carriers.push_back(link(one.relative_to, "collider '" + one.name + "'", at_start));
            depends_on_state |= !is_prescribed(one);
        }
        for (const ConstraintDescription& one : of.constraints) {
            const std::string where = "constraints[" + std::to_string(constraint_regions.size()) + "]";
            constraint_carriers.push_back(link(one.relative_to, where, at_start));
            constraint_regions.push_back(region_of(one, where, at_start));
            depends_on_state |= constraint_carriers.back() && !constraint_carriers.back()->is_prescribed;
        }
        for (const HandleDescription& one : of.handles) {
            const std::string where = "handle '" + one.name + "'";
            handle_carriers.push_back(link(one.relative_to, where, at_start));
            handle_regions.push_back(region_of(one, where, at_start));
            depends_on_state |= handle_carriers.back() && !handle_carriers.back()->is_prescribed;
        }
    }

    std::optional<Link> link(const std::optional<Carrier>& carrier, const std::string& where,
                             Bodies at_start) {
        if (!carrier) return std::nullopt;
        Link out{carrier->kind, 0, carrier_is_prescribed(*scene, *carrier)};
        if (carrier->kind == CarrierKind::tool) out.index = index_of_name(scene->tools, carrier->name);
        if (carrier->kind == CarrierKind::collider)
            out.index = index_of_name(scene->colliders, carrier->name);
        if (carrier->kind != CarrierKind::body) return out;
        out.index = frames.size();
        frames.push_back(frame(carrier->name, carrier->region, where + " relative_to", at_start));
        return out;
    }

    std::pair<std::size_t, MaterialFrame> frame(const std::string& body, const std::optional<Region>& region,
                                                const std::string& where, Bodies at_start) const {
        const std::size_t index = index_of_name(scene->bodies, body);
        const BodySamples samples = at_start.empty() ? BodySamples() : at_start[index];
        MaterialFrame out(region ? region_test(*region) : nullptr, samples);
        if (!at_start.empty() && !out.has_samples())
            throw InputError(where, "its region holds no phyxel of body '" + body + "'",
                             "make it larger, or the phyxel spacing smaller");
        return {index, std::move(out)};
    }

    template <class Description>
    std::optional<std::pair<std::size_t, MaterialFrame>> region_of(const Description& one,
                                                                   const std::string& where,
                                                                   Bodies at_start) {
        depends_on_state |= one.start_when || one.release_when;
        takes_over |= one.start_when.has_value();
        if (!one.start_when) return std::nullopt;
        return frame(one.body, one.region, where, at_start);
    }
};

Course::Course(const SceneDescription& scene, Bodies at_start)
    : plan_(std::make_shared<const Plan>(scene, at_start)),
      tools_(scene.tools.size()),
      colliders_(scene.colliders.size()),
      constraints_(scene.constraints.size()),
      handles_(scene.handles.size()),
      material_(plan_->frames.size()) {
    for (SampledMotion& motion : material_) motion.add(0, Isometry::Identity());
}

bool Course::depends_on_state() const {
    return plan_->depends_on_state;
}

bool Course::reads_samples() const {
    return !plan_->frames.empty() || plan_->takes_over;
}

bool Course::decides_tool(std::size_t index) const {
    return !is_prescribed(plan_->scene->tools[index]);
}

bool Course::decides_collider(std::size_t index) const {
    return !is_prescribed(plan_->scene->colliders[index]);
}

bool Course::decides_constraint(std::size_t index) const {
    const ConstraintDescription& one = plan_->scene->constraints[index];
    const std::optional<Link>& carrier = plan_->constraint_carriers[index];
    return one.start_when || one.release_when || (carrier && !carrier->is_prescribed);
}

bool Course::decides_handle(std::size_t index) const {
    const HandleDescription& one = plan_->scene->handles[index];
    const std::optional<Link>& carrier = plan_->handle_carriers[index];
    return one.start_when || one.release_when || (carrier && !carrier->is_prescribed);
}

void Course::advance(double time, double time_step, Bodies bodies) {
    if (!depends_on_state()) return;
    forget_after(time + 0.5 * time_step);
    start_and_end(time, bodies);
    if (!reads_samples()) return take_over(time, bodies);
    follow_material(time, time_step, bodies);
    take_over(time, bodies);
}

// One sample always stays: it is what the next one begins with.
void Course::forget_after(double time) {
    const auto forget = [time](Clock& clock) {
        if (clock.started && *clock.started > time) clock = {};
        if (clock.ended && *clock.ended > time) clock.ended.reset();
    };
    for (std::vector<Clock>* clocks : {&tools_, &colliders_})
        for (Clock& clock : *clocks) forget(clock);
    for (std::vector<Hold>* holds : {&constraints_, &handles_})
        for (Hold& hold : *holds) {
            const bool had_started = hold.clock.started.has_value();
            forget(hold.clock);
            if (had_started && !hold.clock.started) hold.grip.reset();
            if (hold.base && hold.base->first > time) hold.base.reset();
        }
    for (SampledMotion& motion : material_) {
        if (motion.times().back() <= time) continue;
        SampledMotion kept;
        for (std::size_t k = 0; k < motion.times().size() && motion.times()[k] <= time; ++k)
            kept.add(motion.times()[k], motion.frames()[k]);
        if (kept.empty()) kept.add(-never, motion.frames().front());
        motion = std::move(kept);
    }
}

void Course::go_back(double time, double time_step, Bodies bodies) {
    forget_after(time + 0.5 * time_step);
    for (std::size_t k = 0; k < material_.size(); ++k) {
        const auto& [body, frame] = plan_->frames[k];
        const Isometry now = frame.fit(bodies[body], 0, material_[k].frames().back());
        material_[k] = {};
        material_[k].add(time, now);
    }
}

bool Course::has_ended(std::size_t tool, double time) const {
    const ToolDescription& of = plan_->scene->tools[tool];
    const Clock& clock = tools_[tool];
    if (of.start_when && !clock.started) return false;
    return clock.ended || time - clock.started.value_or(0) >= times_of(of.motion).second - same_time;
}

bool Course::holds_now(const Condition& when, double time, Bodies bodies) const {
    if (when.time && time < *when.time - same_time) return false;
    if (!when.ended.empty() && !has_ended(index_of_name(plan_->scene->tools, when.ended), time)) return false;
    return when.body.empty() || bodies[index_of_name(plan_->scene->bodies, when.body)].piece_count >=
                                    static_cast<std::size_t>(when.at_least);
}

void Course::start_and_end(double time, Bodies bodies) {
    const auto set = [&](Clock& clock, const auto& start, const auto& end) {
        if (start && !clock.started && holds_now(*start, time, bodies)) clock.started = time;
        if (end && !clock.ended && (!start || clock.started) && holds_now(*end, time, bodies))
            clock.ended = time;
    };
    const SceneDescription& scene = *plan_->scene;
    for (std::size_t k = 0; k < tools_.size(); ++k)
        set(tools_[k], scene.tools[k].start_when, scene.tools[k].end_when);
    for (std::size_t k = 0; k < colliders_.size(); ++k)
        set(colliders_[k], scene.colliders[k].start_when, scene.colliders[k].end_when);
    for (std::size_t k = 0; k < constraints_.size(); ++k)
        set(constraints_[k].clock, scene.constraints[k].start_when, scene.constraints[k].release_when);
    for (std::size_t k = 0; k < handles_.size(); ++k)
        set(handles_[k].clock, scene.handles[k].start_when, scene.handles[k].release_when);
}

// Where the present is not known, as after a travel in time, it is measured.
void Course::follow_material(double time, double time_step, Bodies bodies) {
    for (std::size_t k = 0; k < material_.size(); ++k) {
        const auto& [body, frame] = plan_->frames[k];
        SampledMotion& motion = material_[k];
        if (motion.times().back() < time - 0.5 * time_step) {
            const Isometry now = frame.fit(bodies[body], 0, motion.frames().back());
            if (motion.times().back() == -never) motion = {};
            motion.add(time, now);
        }
        motion.add(time + time_step, frame.fit(bodies[body], time_step, motion.frames().back()));
    }
}

void Course::take_over(double time, Bodies bodies) {
    const auto grip = [&](Hold& hold, const auto& region) {
        if (region && hold.clock.started && !hold.grip)
            hold.grip = region->second.fit(bodies[region->first], 0, Isometry::Identity());
    };
    for (std::size_t k = 0; k < constraints_.size(); ++k) {
        grip(constraints_[k], plan_->constraint_regions[k]);
        note_base(constraints_[k], plan_->constraint_carriers[k], constraint_activity(k).first, time);
    }
    for (std::size_t k = 0; k < handles_.size(); ++k) {
        grip(handles_[k], plan_->handle_regions[k]);
        note_base(handles_[k], plan_->handle_carriers[k], handle_activity(k).first, time);
    }
}

void Course::note_base(Hold& hold, const std::optional<Link>& carrier, double begin, double time) const {
    if (carrier && !hold.base && time >= begin) hold.base = std::pair(time, carried(*carrier, time));
}

void Course::forget_before(double time) {
    for (SampledMotion& motion : material_) motion.forget_before(time);
}

Isometry Course::carried(const Link& link, double time) const {
    if (link.kind == CarrierKind::tool) return tool_frame(link.index, time);
    if (link.kind == CarrierKind::collider) return collider_displacement(link.index, time);
    return material_[link.index].at(time);
}

Isometry Course::tool_frame(std::size_t index, double time) const {
    const Clock& clock = tools_[index];
    const bool waits = plan_->scene->tools[index].start_when.has_value();
    const Isometry own = plan_->blades[index].frame(own_time(clock.started, clock.ended, waits, time));
    const std::optional<Link>& carrier = plan_->tool_carriers[index];
    return carrier ? Isometry(carried(*carrier, time) * own) : own;
}

Isometry Course::collider_displacement(std::size_t index, double time) const {
    const ColliderDescription& of = plan_->scene->colliders[index];
    const Clock& clock = colliders_[index];
    const Isometry own = keyframe_motion(
        of.keyframes, of.pivot, own_time(clock.started, clock.ended, of.start_when.has_value(), time));
    const std::optional<Link>& carrier = plan_->collider_carriers[index];
    return carrier ? Isometry(carried(*carrier, time) * own) : own;
}

Isometry Course::collider_frame(std::size_t index, double time) const {
    return collider_displacement(index, time) * pose_of(plan_->scene->colliders[index].placement);
}

Isometry Course::constraint_motion(std::size_t index, double time) const {
    const ConstraintDescription& of = plan_->scene->constraints[index];
    const Hold& hold = constraints_[index];
    const double at = own_time(hold.clock.started, {}, of.start_when.has_value(), time);
    const bool moves = of.kind == ConstraintKind::move;
    const Isometry grip = hold.grip.value_or(Isometry::Identity());
    const Isometry own = moves ? Isometry(keyframe_motion(of.keyframes, grip * of.pivot, at) * grip) : grip;
    return carried_on(hold, plan_->constraint_carriers[index], of.from_time, own, time);
}

// On from where the carrier was when the thing began to act.
Isometry Course::carried_on(const Hold& hold, const std::optional<Link>& carrier, double from_time,
                            const Isometry& own, double time) const {
    if (!carrier) return own;
    if (carrier->is_prescribed) {
        const double began = hold.clock.started.value_or(0) + from_time;
        return carried(*carrier, time) * carried(*carrier, began).inverse() * own;
    }
    return hold.base ? Isometry(carried(*carrier, time) * hold.base->second.inverse() * own) : own;
}

Isometry Course::handle_motion(std::size_t index, double time) const {
    const HandleDescription& of = plan_->scene->handles[index];
    const Hold& hold = handles_[index];
    const double at = own_time(hold.clock.started, {}, of.start_when.has_value(), time);
    const Isometry own = hold.grip
                             ? Isometry(keyframe_motion(of.keyframes, *hold.grip * of.pivot, at) * *hold.grip)
                             : keyframe_motion(of.keyframes, of.pivot, at);
    return carried_on(hold, plan_->handle_carriers[index], of.from_time, own, time);
}

Course::Interval Course::tool_activity(std::size_t index) const {
    const ToolDescription& of = plan_->scene->tools[index];
    const Clock& clock = tools_[index];
    if (of.start_when && !clock.started) return {never, never};
    return shifted(of.active_from, of.active_until, clock.started.value_or(0), clock.ended);
}

Course::Interval Course::constraint_activity(std::size_t index) const {
    const ConstraintDescription& of = plan_->scene->constraints[index];
    const Clock& clock = constraints_[index].clock;
    if (of.start_when && !clock.started) return {never, never};
    return shifted(of.from_time, of.until_time, clock.started.value_or(0), clock.ended);
}

Course::Interval Course::handle_activity(std::size_t index) const {
    const HandleDescription& of = plan_->scene->handles[index];
    const Clock& clock = handles_[index].clock;
    if (of.start_when && !clock.started) return {never, never};
    return shifted(of.from_time, of.until_time, clock.started.value_or(0), clock.ended);
}

Course::Interval Course::tool_shown(std::size_t index) const {
    const ToolDescription& of = plan_->scene->tools[index];
    const Clock& clock = tools_[index];
    const auto [first, last] = times_of(of.motion);
    if (of.solid || (of.relative_to && !of.start_when && first == last)) return {-never, never};
    if (of.start_when && !clock.started) return {never, never};
    const auto [from, until] = shown_times(of);
    const double by = clock.started.value_or(0);
    return {from + by, of.relative_to && first == last ? never : until + by};
}

std::vector<double> Course::tool_times(std::size_t index, double from, double to) const {
    const Clock& clock = tools_[index];
    const bool waits = plan_->scene->tools[index].start_when.has_value();
    std::vector<double> out =
        cutting::sweep_times(plan_->blades[index], own_time(clock.started, clock.ended, waits, from),
                             own_time(clock.started, clock.ended, waits, to));
    for (double& t : out) t += clock.started.value_or(0);
    // Poses that are given one after the other come from several steps, whose ends differ by rounding.
    const double margin = decides_tool(index) ? same_time : 0;
    std::erase_if(out, [&](double t) { return !(t > from + margin) || t >= to - margin; });
    out.push_back(to);
    return out;
}

}  // namespace splitcubes::scene
