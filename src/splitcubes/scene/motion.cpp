#include <splitcubes/core/error.h>
#include <splitcubes/scene/motion.h>

#include <splitcubes/scene/overloaded.h>
#include <splitcubes/scene/reader.h>
#include <splitcubes/scene/tuning.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace splitcubes::scene {

namespace {

constexpr double radians = std::numbers::pi / 180;

cutting::BladeShape blade_shape(const BladeDescription& blade) {
    return std::visit(
        Overloaded{[](const PolylineBlade& b) { return cutting::BladeShape{{b.points}}; },
                   [](const StraightBlade& b) { return cutting::make_straight_blade(b.from, b.to); },
                   [](const ArcBlade& b) {
                       return cutting::make_arc_blade(b.center, b.radius, b.axis,
                                                      b.start_angle_degrees * radians,
                                                      b.end_angle_degrees * radians, b.segments);
                   }},
        blade);
}

std::vector<cutting::Keyframe> keyframes_of(const CircularMotion& circle) {
    return cutting::circular_path(circle.center, circle.axis, circle.radius,
                                  circle.start_angle_degrees * radians, circle.turns, circle.from_time,
                                  circle.until_time, circle.turn_with_path);
}

std::vector<cutting::Keyframe> keyframes_of(const KeyframeMotion& motion) {
    std::vector<cutting::Keyframe> out;
    for (const MotionKeyframe& k : motion.keyframes)
        out.push_back({k.time, k.position, quaternion(k.rotation)});
    return out;
}

// Those of the circle, raised and moved outwards by the share of the time that has passed.
std::vector<cutting::Keyframe> keyframes_of(const HelixMotion& helix) {
    const CircularMotion& circle = helix.circle;
    std::vector<cutting::Keyframe> out = keyframes_of(circle);
    const Vec3 axis = circle.axis.normalized();
    const double growth = helix.end_radius.value_or(circle.radius) - circle.radius;
    const Vec3 zero = cutting::angle_zero_about(circle.axis);
    for (cutting::Keyframe& key : out) {
        const double share = (key.time - circle.from_time) / (circle.until_time - circle.from_time);
        const double angle =
            circle.start_angle_degrees * radians + 2 * std::numbers::pi * circle.turns * share;
        const Vec3 outwards = Eigen::AngleAxisd(angle, axis) * zero;
        key.position += helix.rise * share * axis + growth * share * outwards;
    }
    return out;
}

cutting::PathInterpolation interpolation_of(const SimpleMotion& motion) {
    const auto* path = std::get_if<KeyframeMotion>(&motion);
    return path != nullptr && path->interpolation == Interpolation::smooth
               ? cutting::PathInterpolation::smooth
               : cutting::PathInterpolation::linear;
}

std::vector<cutting::Keyframe> keyframes_of(const SimpleMotion& motion) {
    return std::visit([](const auto& m) { return keyframes_of(m); }, motion);
}

cutting::Blade path_of(const SimpleMotion& motion) {
    cutting::BladeOptions options;
    options.interpolation = interpolation_of(motion);
    return {"path", cutting::make_straight_blade(Vec3::Zero(), Vec3::UnitX()), keyframes_of(motion), options};
}

void require_samples(std::size_t count) {
    constexpr std::size_t most = 1000000;
    if (count > most)
        throw InputError("composed motion", "has more than " + std::to_string(most) + " samples",
                         "let its parts turn less often");
}

// Samples often enough that straight lines between the samples follow the turns of all parts.
std::vector<cutting::Keyframe> keyframes_of(const ComposedMotion& motion) {
    std::vector<cutting::Blade> parts;
    std::vector<double> times;
    for (const SimpleMotion& part : motion.parts) {
        parts.push_back(path_of(part));
        const bool is_smooth = interpolation_of(part) == cutting::PathInterpolation::smooth;
        const std::vector<cutting::Keyframe>& keys = parts.back().keyframes();
        for (std::size_t k = 0; k < keys.size(); ++k) {
            times.push_back(keys[k].time);
            constexpr int pieces = tuning::motion::samples_per_smooth_span;
            for (int j = 1; is_smooth && k + 1 < keys.size() && j < pieces; ++j)
                times.push_back(keys[k].time + (keys[k + 1].time - keys[k].time) * j / pieces);
        }
    }
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
    require_samples(times.size());
    std::vector<double> finer = {times.front()};
    for (std::size_t k = 0; k + 1 < times.size(); ++k) {
        double turn = 0;
        for (const cutting::Blade& part : parts)
            turn += Eigen::AngleAxisd(part.frame(times[k]).linear().transpose() *
                                      part.frame(times[k + 1]).linear())
                        .angle();
        const int count =
            std::clamp(static_cast<int>(std::ceil(turn / (radians * tuning::motion::sample_degrees))), 1, 64);
        for (int j = 1; j <= count; ++j) {
            const double t = j == count ? times[k + 1] : times[k] + (times[k + 1] - times[k]) * j / count;
            if (t > finer.back()) finer.push_back(t);
        }
        require_samples(finer.size());
    }
    std::vector<cutting::Keyframe> out;
    for (const double t : finer) {
        Isometry frame = Isometry::Identity();
        for (const cutting::Blade& part : parts) frame = frame * part.frame(t);
        out.push_back({t, frame.translation(), Quat(frame.linear())});
    }
    return out;
}

void delay(KeyframeMotion& motion, double by) {
    for (MotionKeyframe& key : motion.keyframes) key.time += by;
}
void delay(CircularMotion& motion, double by) {
    motion.from_time += by;
    motion.until_time += by;
}
void delay(HelixMotion& motion, double by) {
    delay(motion.circle, by);
}
void delay(ComposedMotion& motion, double by) {
    for (SimpleMotion& part : motion.parts) std::visit([by](auto& m) { delay(m, by); }, part);
}

// A thing's displacement and turn as the k-th copy.
struct Step {
    Vec3 shift;
    Quat turn;
    Vec3 pivot;
    bool turns;

    Step(const Repetition& repetition, int k)
        : shift(k * repetition.position),
          turn(Eigen::AngleAxisd(k * repetition.rotation.angle_degrees * radians,
                                 repetition.rotation.axis.normalized())),
          pivot(repetition.pivot),
          turns(repetition.rotation.angle_degrees != 0) {}
    Vec3 operator()(const Vec3& p) const {
        return turns ? Vec3(pivot + shift + turn * (p - pivot)) : Vec3(p + shift);
    }
    Rotation operator()(const Rotation& rotation) const {
        return turns ? rotation_of(turn * quaternion(rotation)) : rotation;
    }
};

void append_parts(const Motion& motion, std::vector<SimpleMotion>& out) {
    std::visit(
        Overloaded{[&](const ComposedMotion& m) { out.insert(out.end(), m.parts.begin(), m.parts.end()); },
                   [&](const auto& m) { out.push_back(m); }},
        motion);
}

std::pair<double, double> span_of(const KeyframeMotion& motion) {
    if (motion.keyframes.empty()) return {0, 0};
    return {motion.keyframes.front().time, motion.keyframes.back().time};
}
std::pair<double, double> span_of(const CircularMotion& motion) {
    return {motion.from_time, motion.until_time};
}
std::pair<double, double> span_of(const HelixMotion& motion) {
    return span_of(motion.circle);
}
// Parts of a single keyframe only place the others.
std::pair<double, double> span_of(const ComposedMotion& motion) {
    std::optional<std::pair<double, double>> out;
    for (const SimpleMotion& part : motion.parts) {
        const auto times = std::visit([](const auto& m) { return span_of(m); }, part);
        if (times.first == times.second) continue;
        if (!out) out = times;
        out->first = std::min(out->first, times.first);
        out->second = std::max(out->second, times.second);
    }
    if (out || motion.parts.empty()) return out.value_or(std::pair{0.0, 0.0});
    return std::visit([](const auto& m) { return span_of(m); }, motion.parts.back());
}

}  // namespace

Quat quaternion(const Rotation& rotation) {
    return Quat(Eigen::AngleAxisd(rotation.angle_degrees * radians, rotation.axis.normalized()));
}

Rotation rotation_of(const Quat& turn) {
    const Eigen::AngleAxisd both(turn.normalized());
    if (!(std::abs(both.angle()) > 0)) return {};
    return {both.axis(), both.angle() / radians};
}

// Interpolates linearly between the keyframes.
Isometry keyframe_motion(const std::vector<MotionKeyframe>& keys, const Vec3& pivot, double time) {
    Isometry out = Isometry::Identity();
    if (keys.empty()) return out;
    const auto after = std::upper_bound(keys.begin(), keys.end(), time,
                                        [](double t, const MotionKeyframe& k) { return t < k.time; });
    const MotionKeyframe& b = after == keys.end() ? keys.back() : *after;
    const MotionKeyframe& a = after == keys.begin() ? keys.front() : *(after - 1);
    const double s = b.time > a.time ? std::clamp((time - a.time) / (b.time - a.time), 0.0, 1.0) : 0.0;
    const Vec3 shift = a.position + s * (b.position - a.position);
    const Quat turn = quaternion(a.rotation).slerp(s, quaternion(b.rotation));
    out.linear() = turn.toRotationMatrix();
    out.translation() = pivot + shift - out.linear() * pivot;
    return out;
}

std::pair<double, double> times_of(const Motion& motion) {
    return std::visit([](const auto& m) { return span_of(m); }, motion);
}

cutting::Blade make_blade(const ToolDescription& tool) {
    cutting::BladeShape shape;
    for (const BladeDescription& blade : tool.blades)
        for (auto& line : blade_shape(blade).polylines) shape.polylines.push_back(line);
    cutting::BladeOptions options;
    options.active_from = tool.active_from;
    options.active_until = tool.active_until;
    if (const auto* path = std::get_if<KeyframeMotion>(&tool.motion))
        options.interpolation = interpolation_of(*path);
    return {tool.name, std::move(shape),
            std::visit([](const auto& m) { return keyframes_of(m); }, tool.motion), options};
}

Isometry motion_since(const cutting::Blade& blade, double from, double time) {
    return blade.frame(time) * blade.frame(from).inverse();
}

const ToolDescription* find_tool(std::span<const ToolDescription> tools, std::string_view name) {
    const auto found =
        std::find_if(tools.begin(), tools.end(), [&](const ToolDescription& t) { return t.name == name; });
    return found == tools.end() ? nullptr : &*found;
}

Motion composed(const Motion& outer, const Motion& inner) {
    ComposedMotion out;
    append_parts(outer, out.parts);
    append_parts(inner, out.parts);
    return out;
}

bool is_prescribed(const ToolDescription& tool) {
    return !tool.relative_to && !tool.start_when && !tool.end_when;
}

bool is_prescribed(const ColliderDescription& collider) {
    return !collider.relative_to && !collider.start_when && !collider.end_when;
}

namespace {

// Displacement with a rotation about the pivot: the pivot's path and, in it, what lies about it.
Motion displacement_of(const ColliderDescription& collider) {
    KeyframeMotion path, back;
    for (MotionKeyframe key : collider.keyframes) {
        key.position += collider.pivot;
        path.keyframes.push_back(key);
    }
    if (path.keyframes.empty()) path.keyframes.push_back({0, collider.pivot, {}});
    back.keyframes.push_back({0, -collider.pivot, {}});
    return composed(path, back);
}

}  // namespace

std::optional<Motion> prescribed_motion(const Carrier& carrier,
                                        std::span<const ColliderDescription> colliders,
                                        std::span<const ToolDescription> tools) {
    if (carrier.kind == CarrierKind::tool)
        if (const ToolDescription* tool = find_tool(tools, carrier.name); tool && is_prescribed(*tool))
            return tool->motion;
    if (carrier.kind == CarrierKind::collider)
        for (const ColliderDescription& one : colliders)
            if (one.name == carrier.name && is_prescribed(one)) return displacement_of(one);
    return std::nullopt;
}

namespace {

bool is_in_range(const Vec3& p) {
    return p.array().abs().maxCoeff() <= any_number.high;
}
// Close times may have become one by a delay.
bool is_in_range(const KeyframeMotion& motion) {
    const std::vector<MotionKeyframe>& keys = motion.keyframes;
    for (std::size_t k = 0; k < keys.size(); ++k)
        if (keys[k].time > any_time.high || !is_in_range(keys[k].position) ||
            (k > 0 && !(keys[k].time > keys[k - 1].time)))
            return false;
    return true;
}
bool is_in_range(const CircularMotion& motion) {
    return motion.until_time <= any_time.high && motion.until_time > motion.from_time;
}
bool is_in_range(const HelixMotion& motion) {
    return is_in_range(motion.circle);
}
bool is_in_range(const ComposedMotion& motion) {
    return motion.parts.size() <= ParseLimits::motion_parts &&
           std::all_of(motion.parts.begin(), motion.parts.end(), [](const SimpleMotion& part) {
               return std::visit([](const auto& m) { return is_in_range(m); }, part);
           });
}

}  // namespace

std::size_t item_count(const ToolDescription& tool) {
    std::size_t out = tool.blades.size() + tool.bodies.size();
    for (const BladeDescription& blade : tool.blades)
        if (const auto* line = std::get_if<PolylineBlade>(&blade)) out += line->points.size();
    std::vector<SimpleMotion> parts;
    append_parts(tool.motion, parts);
    for (const SimpleMotion& part : parts)
        if (const auto* path = std::get_if<KeyframeMotion>(&part)) out += path->keyframes.size();
    return out;
}

std::size_t item_count(const BodyDescription& body) {
    std::size_t out = 1;
    if (const auto* shape = std::get_if<ImplicitShape>(&body.shape)) out += shape->parts.size();
    if (body.material.tearing) out += body.material.tearing->strength_map.size();
    const auto* form = body.deformation ? std::get_if<FreeFormDescription>(&*body.deformation) : nullptr;
    if (form != nullptr)
        for (const LatticeKeyframeDescription& key : form->keyframes) out += 1 + key.points.size();
    return out;
}

bool is_sayable(const ToolDescription& tool) {
    return tool.name.size() <= ParseLimits::name_length && tool.active_until <= any_time.high &&
           tool.shown_from.value_or(0) <= any_time.high && tool.shown_until.value_or(0) <= any_time.high &&
           std::visit([](const auto& m) { return is_in_range(m); }, tool.motion);
}

bool is_sayable(const BodyDescription& body) {
    return body.name.size() <= ParseLimits::name_length && is_in_range(body.placement.position) &&
           is_in_range(body.velocity) && is_in_range(body.angular_velocity);
}

ToolDescription repeated(ToolDescription tool, const Repetition& repetition, int k) {
    if (k == 0) return tool;
    const Step step(repetition, k);
    const double by = k * repetition.time;
    std::visit([by](auto& m) { delay(m, by); }, tool.motion);
    tool.active_from += by;
    tool.active_until += by;
    if (tool.shown_from) *tool.shown_from += by;
    if (tool.shown_until) *tool.shown_until += by;
    if (auto* path = std::get_if<KeyframeMotion>(&tool.motion)) {
        for (MotionKeyframe& key : path->keyframes) {
            key.position = step(key.position);
            key.rotation = step(key.rotation);
        }
    } else {
        KeyframeMotion place;
        place.keyframes.push_back({0, step(Vec3(Vec3::Zero())), step(Rotation{})});
        tool.motion = composed(place, tool.motion);
    }
    return tool;
}

BodyDescription repeated(BodyDescription body, const Repetition& repetition, int k) {
    if (k == 0) return body;
    const Step step(repetition, k);
    body.placement.position = step(body.placement.position);
    body.placement.rotation = step(body.placement.rotation);
    if (step.turns) {
        body.velocity = step.turn * body.velocity;
        body.angular_velocity = step.turn * body.angular_velocity;
    }
    return body;
}

}  // namespace splitcubes::scene
