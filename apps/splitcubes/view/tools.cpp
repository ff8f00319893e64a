#include "tools.h"

#include "parameters.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace splitcubes::view {

namespace {

constexpr std::array<ToolInfo, tool_count> tools = {{
    {"Knife", "1", "Draw a line: cuts along the view, through or to a depth"},
    {"Scalpel", "2", "Draw on the surface: cuts to a depth below it"},
    {"Scissors", "3", "Drag from the edge inwards: snips when the button is released"},
    {"Grab", "4", "Pull the material; wheel: nearer or farther; P while pulling: pin it there"},
    {"Tear", "5", "Pull until the material breaks"},
    {"Free blade", "6", "Cuts while the button is down; wheel: nearer or farther; W A S D Q E: turn it"},
    {"Pin", "7", "Click: hold the material there; click a pin: let go"},
    {"Forceps", "8",
     "Two jaws close on the tissue and hold it up to their force; wheel: nearer or farther; P: leave "
     "them there; click them: take them off"},
}};

constexpr int blade_slot = 0, upper_slot = 1, lower_slot = 2;
constexpr double pin_reach = 14;           // pixels, of clicks on pins
constexpr double scissors_opening = 0.7;   // rad, of each blade
constexpr double scissors_closing = 0.02;  // rad, past each other
constexpr int scissors_frames = 24;
constexpr int scissors_frames_per_step = 3;
constexpr double wheel_share = 0.05;                       // of the depth, a notch
constexpr double turn_step = 0.09;                         // rad, a key press
constexpr double pull_radius = 1.3;                        // phyxel spacings
constexpr double grab_stiffness = 4, tear_stiffness = 40;  // times Young's modulus times the radius
constexpr double jaw_stiffness = 2;       // of each jaw, times Young's modulus times the radius
constexpr double grip_share = 1;          // of Young's modulus times the radius squared: what forceps hold
constexpr double closing_share = 0.3;     // of half the opening, by which each jaw closes
constexpr double squeeze_share = 0.4;     // of the force up to which they hold, at most
constexpr double jaw_depth = 0.4;         // of the opening, below the surface
constexpr double forceps_lean = 0.45;     // of the shanks, upwards in the picture
constexpr double default_strength = 0.2;  // of Young's modulus, for tearing what does not tear
constexpr double cells_outside = 2;       // that blades reach out of the surface
constexpr double normal_memory = 0.6;     // of the scalpel's direction, from pick to pick

double cell_of(const PublishedState& state) {
    return state.parameters.size() > cell_size ? state.parameters[cell_size] : 0.01;
}

double extent_of(const PublishedState& state) {
    geometry::Box box;
    for (const BodyState& body : state.bodies)
        if (!body.bounds.empty()) box.add(body.bounds);
    return box.empty() ? 1 : box.size().norm();
}

// Axes whose third is `z` and whose first is as near to `x` as can be.
Mat3 axes_along(const Vec3& z, const Vec3& x) {
    Vec3 first = x - x.dot(z) * z;
    if (!(first.norm() > 1e-9)) first = z.unitOrthogonal();
    first.normalize();
    Mat3 out;
    out << first, z.cross(first), z;
    return out;
}

Isometry frame_at(const Vec3& position, const Mat3& axes) {
    Isometry out = Isometry::Identity();
    out.linear() = axes;
    out.translation() = position;
    return out;
}

Command blade_command(CommandKind kind, int slot) {
    Command out;
    out.kind = kind;
    out.slot = slot;
    return out;
}

}  // namespace

const std::array<ToolInfo, tool_count>& tool_list() {
    return tools;
}

void Tools::select(ToolKind kind, std::vector<Command>& out) {
    cancel(out);
    kind_ = kind;
    shift_ = Vec3::Zero();
    scalpel_.reset();
    forceps_.reset();
}

void Tools::suit(double body_size) {
    if (std::abs(body_size - suited_) < 0.05 * suited_) return;
    suited_ = body_size;
    settings.knife_depth = 0.15 * body_size;
    settings.scalpel_depth = 0.08 * body_size;
    settings.scissors_length = 0.2 * body_size;
    settings.blade_length = 0.6 * body_size;
    settings.forceps_width = 0.08 * body_size;
    has_depth_ = false;
}

Vec3 Tools::point_at_depth(const ToolContext& context, double depth) const {
    const Ray ray = context.camera.ray(x_, y_, context.size);
    return ray.at(depth / std::max(ray.direction.dot(context.camera.forward()), 1e-6));
}

// Off the body it keeps the depth of the last hit; one that goes to a depth waits for the first.
std::optional<Tools::BladePose> Tools::knife_pose(const ToolContext& context) {
    const Ray ray = context.camera.ray(x_, y_, context.size);
    const std::optional<Pick> hit = pick(context.state, ray);
    BladePose out;
    if (hit) {
        depth_ = hit->distance * ray.direction.dot(context.camera.forward());
        has_depth_ = true;
        out.anchor = hit->point;
    } else if (!has_depth_) {
        if (!settings.knife_through) return std::nullopt;
        depth_ = context.camera.distance;
    }
    out.frame = frame_at(point_at_depth(context, depth_), axes_along(ray.direction, context.camera.right()));
    return out;
}

// Cut faces that come into view do not turn the blade.
std::optional<Tools::BladePose> Tools::scalpel_pose(const ToolContext& context) {
    const std::optional<Pick> hit = pick(context.state, context.camera.ray(x_, y_, context.size));
    if (!hit) return std::nullopt;
    Vec3 normal = hit->normal;
    if (lowered_) {
        if (hit->origin == SurfaceOrigin::cut) normal = last_normal_;
        normal = (normal_memory * last_normal_ + (1 - normal_memory) * normal).normalized();
        const Vec3 motion = hit->point.world - last_point_;
        if (motion.norm() > 0.2 * cell_of(context.state))
            direction_ =
                (normal_memory * direction_ + (1 - normal_memory) * motion.normalized()).normalized();
    } else {
        direction_ = context.camera.right();
    }
    last_normal_ = normal;
    last_point_ = hit->point.world;
    const double tilt = settings.scalpel_tilt * std::numbers::pi / 180;
    const Vec3 inwards = Eigen::AngleAxisd(tilt, direction_) * Vec3(-normal);
    scalpel_ = frame_at(hit->point.world, axes_along(inwards, direction_));
    return BladePose{*scalpel_, hit->point};
}

Tools::BladePose Tools::free_pose(const ToolContext& context) const {
    const Mat3 turn =
        (Eigen::AngleAxisd(angles_.x(), Vec3::UnitZ()) * Eigen::AngleAxisd(angles_.y(), Vec3::UnitX()) *
         Eigen::AngleAxisd(angles_.z(), Vec3::UnitY()))
            .toRotationMatrix();
    const Mat3 view = axes_along(context.camera.forward(), context.camera.right());
    const OrbitCamera& camera = context.camera;
    const Vec3 shift = shift_.x() * camera.right() + shift_.y() * camera.up() - shift_.z() * camera.forward();
    return {frame_at(point_at_depth(context, has_depth_ ? depth_ : camera.distance) + shift, view * turn),
            {}};
}

std::optional<Tools::BladePose> Tools::blade_pose(const ToolContext& context) {
    if (kind_ == ToolKind::knife) return knife_pose(context);
    if (kind_ == ToolKind::scalpel) return scalpel_pose(context);
    return free_pose(context);
}

std::vector<Vec3> Tools::blade_points(const ToolContext& context) const {
    const double outside = cells_outside * cell_of(context.state);
    if (kind_ == ToolKind::free_blade)
        return {{-0.5 * settings.blade_length, 0, 0}, {0.5 * settings.blade_length, 0, 0}};
    if (kind_ == ToolKind::scalpel) return {{0, 0, -outside}, {0, 0, settings.scalpel_depth}};
    if (!settings.knife_through) return {{0, 0, -outside}, {0, 0, settings.knife_depth}};
    const double extent = extent_of(context.state);
    return {{0, 0, -extent}, {0, 0, extent}};
}

void Tools::begin_blade(const ToolContext& context, std::vector<Command>& out) {
    const std::optional<BladePose> pose = blade_pose(context);
    if (!pose) return;
    Command command = blade_command(CommandKind::begin_stroke, blade_slot);
    command.points = blade_points(context);
    command.frames = {pose->frame};
    command.has_anchor = pose->anchor.has_value();
    if (pose->anchor) command.anchor = *pose->anchor;
    out.push_back(std::move(command));
    trail_ = {pose->frame.translation()};
    lowered_ = true;
}

void Tools::move_blade(const ToolContext& context, std::vector<Command>& out) {
    const std::optional<BladePose> pose = blade_pose(context);
    if (!pose) return;
    trail_.push_back(pose->frame.translation());
    Command command = blade_command(CommandKind::move_stroke, blade_slot);
    command.frames = {pose->frame};
    command.has_anchor = pose->anchor.has_value();
    if (pose->anchor) command.anchor = *pose->anchor;
    out.push_back(std::move(command));
}

void Tools::begin_pull(const ToolContext& context, std::vector<Command>& out) {
    const Ray ray = context.camera.ray(x_, y_, context.size);
    const std::optional<Pick> hit = pick(context.state, ray);
    busy_ = hit.has_value();
    if (!hit) return;
    const std::vector<double>& parameters = context.state.parameters;
    Command command = blade_command(CommandKind::begin_pull, slot_ = next_slot_++);
    command.anchor = hit->point;
    command.has_anchor = true;
    command.frames = {frame_at(Vec3::Zero(), hit->world_from_rest)};
    command.radius = pull_radius * parameters[phyxel_spacing];
    const double factor = kind_ == ToolKind::grab ? grab_stiffness : tear_stiffness;
    command.value = settings.pull_strength * factor * parameters[youngs_modulus] * command.radius;
    if (kind_ == ToolKind::tear && !(parameters[strength] > 0)) {
        Command strong = blade_command(CommandKind::set_parameter, 0);
        strong.name = parameter_list()[strength].name;
        strong.value = default_strength * parameters[youngs_modulus];
        out.push_back(strong);
    }
    out.push_back(std::move(command));
    depth_ = (hit->point.world - context.camera.eye()).dot(context.camera.forward());
    has_depth_ = true;
    pinned_ = false;
}

void Tools::move_pull(const ToolContext& context, std::vector<Command>& out) {
    Command command = blade_command(CommandKind::move_pull, slot_);
    command.points = {point_at_depth(context, depth_)};
    out.push_back(std::move(command));
}

bool Tools::take_pin_off(const ToolContext& context, std::vector<Command>& out) const {
    for (const PullState& pull : context.state.pulls) {
        const Vec3 at = context.camera.project(pull.target, context.size);
        if (!pull.pinned || std::hypot(at.x() - x_, at.y() - y_) > pin_reach) continue;
        out.push_back(blade_command(CommandKind::unpin, pull.slot));
        return true;
    }
    return false;
}

bool Tools::is_pull() const {
    return kind_ == ToolKind::grab || kind_ == ToolKind::tear || kind_ == ToolKind::forceps;
}

// The jaws lie beside each other in the picture, the shanks lean out of the surface.
Isometry Tools::forceps_frame(const Pick& hit, const ToolContext& context) const {
    const Vec3 out = (hit.normal + forceps_lean * context.camera.up()).normalized();
    return frame_at(hit.point.world, axes_along(out, context.camera.right()));
}

double Tools::jaw_radius(const PublishedState& state) const {
    return std::max(state.parameters[phyxel_spacing], 0.45 * settings.forceps_width);
}

double Tools::grip_limit(const PublishedState& state) const {
    const double radius = jaw_radius(state);
    return settings.forceps_grip * grip_share * state.parameters[youngs_modulus] * radius * radius;
}

void Tools::begin_grip(const ToolContext& context, std::vector<Command>& out) {
    busy_ = false;
    forceps_.reset();  // those in the hand are where the pointer is next
    if (take_pin_off(context, out)) return;
    const std::optional<Pick> hit = pick(context.state, context.camera.ray(x_, y_, context.size));
    if (!hit) return;
    busy_ = true;
    slot_ = next_slot_;
    next_slot_ += 2;
    const Isometry frame = forceps_frame(*hit, context);
    const double radius = jaw_radius(context.state), half = 0.5 * settings.forceps_width;
    for (const int side : {1, -1}) {
        Command command = blade_command(CommandKind::begin_pull, side > 0 ? slot_ : slot_ + 1);
        command.partner = side > 0 ? slot_ + 1 : slot_;
        command.anchor = hit->point;
        command.has_anchor = true;
        command.frames = {frame_at(Vec3::Zero(), hit->world_from_rest), frame};
        command.radius = radius;
        command.value = jaw_stiffness * context.state.parameters[youngs_modulus] * radius;
        command.limit = 0.5 * grip_limit(context.state);
        const Vec3 across = side * half * frame.linear().col(0);
        const Vec3 offset = across - jaw_depth * settings.forceps_width * hit->normal;
        // They do not squeeze with all that they hold.
        const double closing = std::min(closing_share * half, squeeze_share * command.limit / command.value);
        command.points = {hit->world_from_rest.transpose() * offset, -side * closing * frame.linear().col(0)};
        out.push_back(std::move(command));
    }
    depth_ = (hit->point.world - context.camera.eye()).dot(context.camera.forward());
    has_depth_ = true;
    pinned_ = false;
}

void Tools::toggle_pin(const ToolContext& context, std::vector<Command>& out) {
    if (take_pin_off(context, out)) return;
    begin_pull(context, out);
    if (busy_) out.push_back(blade_command(CommandKind::pin, slot_));
    busy_ = false;
}

// Two blades turn about a pivot behind the start, one outside of the surface and one inside, until they meet
// in the line that was dragged.
void Tools::snip(const ToolContext& context, std::vector<Command>& out) {
    if (!start_) return;
    const Ray ray = context.camera.ray(x_, y_, context.size);
    const std::optional<Pick> hit = pick(context.state, ray);
    const Vec3 end = hit ? hit->point.world : point_at_depth(context, depth_);
    Vec3 along = end - start_->point.world;
    along -= along.dot(start_->normal) * start_->normal;
    if (!(along.norm() > 1e-6)) return;
    along.normalize();
    const double length = settings.scissors_length, behind = 0.15 * length;
    for (const int side : {1, -1}) {
        Command command = blade_command(CommandKind::begin_stroke, side > 0 ? upper_slot : lower_slot);
        command.points = {Vec3::Zero(), {length + behind, 0, 0}};
        command.frames_per_step = scissors_frames_per_step;
        command.anchor = start_->point;
        command.has_anchor = true;
        const Vec3 pivot = start_->point.world - behind * along;
        Mat3 axes;
        axes << along, start_->normal, along.cross(start_->normal);
        for (int k = 0; k <= scissors_frames; ++k) {
            const double share = static_cast<double>(k) / scissors_frames;
            const double angle = side * (scissors_opening - share * (scissors_opening + scissors_closing));
            const Mat3 turn = Eigen::AngleAxisd(angle, Vec3::UnitZ()).toRotationMatrix();
            command.frames.push_back(frame_at(pivot, axes * turn));
        }
        out.push_back(std::move(command));
    }
}

void Tools::press(double x, double y, const ToolContext& context, std::vector<Command>& out) {
    cancel(out);
    x_ = x;
    y_ = y;
    busy_ = true;
    switch (kind_) {
        case ToolKind::knife:
            has_depth_ = false;
            [[fallthrough]];
        case ToolKind::scalpel:
        case ToolKind::free_blade:
            return begin_blade(context, out);
        case ToolKind::scissors:
            start_ = pick(context.state, context.camera.ray(x, y, context.size));
            busy_ = start_.has_value();
            if (start_) depth_ = (start_->point.world - context.camera.eye()).dot(context.camera.forward());
            return;
        case ToolKind::grab:
        case ToolKind::tear:
            return begin_pull(context, out);
        case ToolKind::forceps:
            return begin_grip(context, out);
        case ToolKind::pin:
            return toggle_pin(context, out);
    }
}

void Tools::move(double x, double y, const ToolContext& context, std::vector<Command>& out) {
    x_ = x;
    y_ = y;
    if (kind_ == ToolKind::scalpel && !busy_ && !scalpel_pose(context)) scalpel_.reset();
    if (kind_ == ToolKind::forceps && !busy_) {
        const std::optional<Pick> hit = pick(context.state, context.camera.ray(x_, y_, context.size));
        forceps_.reset();
        if (hit) forceps_ = forceps_frame(*hit, context);
    }
    if (!busy_) return;
    if (is_pull()) return move_pull(context, out);
    if (kind_ == ToolKind::scissors || kind_ == ToolKind::pin) return;
    lowered_ ? move_blade(context, out) : begin_blade(context, out);
}

void Tools::release(const ToolContext& context, std::vector<Command>& out) {
    if (busy_ && kind_ == ToolKind::scissors) snip(context, out);
    cancel(out);
}

void Tools::cancel(std::vector<Command>& out) {
    if (lowered_) out.push_back(blade_command(CommandKind::end_stroke, blade_slot));
    if (busy_ && !pinned_ && is_pull()) out.push_back(blade_command(CommandKind::end_pull, slot_));
    lowered_ = busy_ = pinned_ = false;
    trail_.clear();
    start_.reset();
}

bool Tools::wheel(double notches, const ToolContext& context, std::vector<Command>& out) {
    if (!(kind_ == ToolKind::free_blade || (is_pull() && busy_))) return false;
    if (!has_depth_) depth_ = context.camera.distance;
    has_depth_ = true;
    depth_ = std::max(1e-6, depth_ + notches * wheel_share * context.camera.distance);
    if (is_pull()) move_pull(context, out);
    if (lowered_) move_blade(context, out);
    return true;
}

void Tools::six_axis(const std::array<double, 6>& axes, const ToolContext& context,
                     std::vector<Command>& out) {
    shift_ += context.camera.distance * Vec3(axes[0], axes[1], axes[2]);
    angles_ += Vec3(-axes[5], axes[3], -axes[4]);
    if (lowered_ && kind_ == ToolKind::free_blade) move_blade(context, out);
}

bool Tools::key(const std::string& name, const ToolContext& context, std::vector<Command>& out) {
    if (name == "p" && busy_ && is_pull()) {
        out.push_back(blade_command(CommandKind::pin, slot_));
        pinned_ = true;
        return true;
    }
    if (kind_ != ToolKind::free_blade) return false;
    const std::string keys = "qewsad";
    const std::size_t at = name.size() == 1 ? keys.find(name) : std::string::npos;
    if (at == std::string::npos) return false;
    angles_[static_cast<int>(at / 2)] += at % 2 == 0 ? turn_step : -turn_step;
    if (lowered_) move_blade(context, out);
    return true;
}

std::optional<HandInstrument> Tools::instrument(const ToolContext& context) const {
    if (kind_ == ToolKind::forceps) {
        if (busy_ || !forceps_) return std::nullopt;  // those that hold are in the state
        HandInstrument out;
        out.kind = kind_;
        out.opening = settings.forceps_width;
        out.frame = *forceps_;
        return out;
    }
    const bool is_free = kind_ == ToolKind::free_blade;
    if (!is_free && !(kind_ == ToolKind::scalpel && scalpel_)) return std::nullopt;
    const std::vector<Vec3> edge = blade_points(context);
    HandInstrument out{.kind = kind_, .from = edge.front(), .to = edge.back()};
    out.handle = (is_free ? 0.25 : 0.3) * extent_of(context.state);
    // The free blade has its edge below and its handle to the right.
    if (is_free) out.back = -Vec3::UnitY();
    out.frame = is_free ? free_pose(context).frame : *scalpel_;
    return out;
}

std::vector<OverlayLine> Tools::overlay(const ToolContext& context) const {
    std::vector<OverlayLine> out;
    for (const std::vector<Vec3>& blade : context.state.blades) out.push_back({blade, true});
    for (const PullState& pull : context.state.pulls)
        if (pull.partner == 0) out.push_back({{pull.at, pull.target}, true});
    if (lowered_ && kind_ != ToolKind::free_blade && trail_.size() > 1) out.push_back({trail_, false});
    if (kind_ == ToolKind::free_blade && !lowered_) {
        OverlayLine line;
        const Isometry frame = free_pose(context).frame;
        for (const Vec3& p : blade_points(context)) line.points.push_back(frame * p);
        out.push_back(std::move(line));
    }
    if (kind_ == ToolKind::scissors && start_)
        out.push_back({{start_->point.world, point_at_depth(context, depth_)}, false});
    return out;
}

}  // namespace splitcubes::view
