#include <splitcubes/core/error.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/cutting/blade.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace splitcubes::cutting {

namespace {

std::string text(double value) {
    return plain_number(value, 6);
}

void require_finite(const std::string& where, double value) {
    if (!std::isfinite(value)) throw InputError(where, "is not finite");
}

void require_finite(const std::string& where, const Vec3& value) {
    if (!value.allFinite()) throw InputError(where, "is not finite");
}

void require_positive(const std::string& where, double value) {
    if (!(value > 0) || !std::isfinite(value))
        throw InputError(where, "must be positive and finite (" + text(value) + ")");
}

Vec3 direction_of(const Vec3& axis) {
    if (!axis.allFinite() || !(axis.stableNorm() > 0))
        throw InputError("circle axis", "has no direction", "give a finite vector other than zero");
    return axis.stableNormalized();
}

void check_shape(const std::string& where, const BladeShape& shape) {
    if (shape.polylines.empty()) throw InputError(where, "has no polyline", "give at least one blade edge");
    for (std::size_t k = 0; k < shape.polylines.size(); ++k) {
        const std::vector<Vec3>& points = shape.polylines[k];
        const std::string element = where + ", polyline " + std::to_string(k);
        if (points.size() < 2)
            throw InputError(element, "has " + std::to_string(points.size()) + " points", "give two or more");
        for (std::size_t i = 0; i < points.size(); ++i)
            require_finite(element + ", point " + std::to_string(i), points[i]);
        if (std::all_of(points.begin(), points.end(), [&](const Vec3& p) { return p == points.front(); }))
            throw InputError(element, "has all its points in one place", "a blade edge needs a length");
    }
}

// Checks the keyframes and normalises their rotations.
void check_keyframes(const std::string& where, std::vector<Keyframe>& keyframes) {
    if (keyframes.empty()) throw InputError(where, "has no keyframe", "give at least one");
    for (std::size_t k = 0; k < keyframes.size(); ++k) {
        Keyframe& key = keyframes[k];
        const std::string element = where + ", keyframe " + std::to_string(k);
        require_finite(element + ", time", key.time);
        require_finite(element + ", position", key.position);
        if (!key.rotation.coeffs().allFinite() || !(key.rotation.coeffs().stableNorm() > 0))
            throw InputError(element + ", rotation", "is not a rotation",
                             "give a finite quaternion other than zero");
        key.rotation.coeffs() = key.rotation.coeffs().stableNormalized().eval();
        if (k > 0 && !(key.time > keyframes[k - 1].time))
            throw InputError(element + ", time",
                             text(key.time) + " s does not come after " + text(keyframes[k - 1].time) + " s",
                             "order keyframes by time");
    }
}

// Returns the velocities of the parabola through each keyframe and its neighbours, for uniform times the
// choice of Catmull and Rom (1974); at the ends those of the first and last parabola.
std::vector<Vec3> smooth_velocities(const std::vector<Keyframe>& keys) {
    const std::size_t n = keys.size();
    std::vector<Vec3> out(n, Vec3::Zero());
    if (n < 2) return out;
    const auto span = [&](std::size_t k) { return keys[k + 1].time - keys[k].time; };
    const auto secant = [&](std::size_t k) -> Vec3 {
        return (keys[k + 1].position - keys[k].position) / span(k);
    };
    for (std::size_t k = 1; k + 1 < n; ++k) {
        const double before = span(k - 1), after = span(k);
        out[k] = (after * secant(k - 1) + before * secant(k)) / (before + after);
    }
    out[0] = n == 2 ? secant(0) : Vec3(2 * secant(0) - out[1]);
    out[n - 1] = n == 2 ? secant(0) : Vec3(2 * secant(n - 2) - out[n - 2]);
    return out;
}

}  // namespace

Vec3 angle_zero_about(const Vec3& axis) {
    const Vec3 unit = direction_of(axis);
    static const double cosine_limit = std::cos(25 * std::numbers::pi / 180);
    const Vec3 reference = std::abs(unit.x()) > cosine_limit ? Vec3::UnitY() : Vec3::UnitX();
    return (reference - reference.dot(unit) * unit).normalized();
}

BladeShape make_straight_blade(const Vec3& from, const Vec3& to) {
    BladeShape shape{{{from, to}}};
    check_shape("straight blade", shape);
    return shape;
}

BladeShape make_arc_blade(const Vec3& center, double radius, const Vec3& axis, double start_angle,
                          double end_angle, int segments) {
    require_finite("arc blade centre", center);
    require_positive("arc blade radius", radius);
    require_finite("arc blade start angle", start_angle);
    require_finite("arc blade end angle", end_angle);
    if (segments < 1 || segments > 65536)
        throw InputError("arc blade segments", std::to_string(segments), "give 1 to 65536");
    const Vec3 unit = direction_of(axis), x = angle_zero_about(axis), y = unit.cross(x);
    std::vector<Vec3> points;
    for (int k = 0; k <= segments; ++k) {
        const double angle = start_angle + (end_angle - start_angle) * k / segments;
        points.push_back(center + radius * (std::cos(angle) * x + std::sin(angle) * y));
    }
    BladeShape shape{{std::move(points)}};
    check_shape("arc blade", shape);
    return shape;
}

std::vector<Keyframe> circular_path(const Vec3& center, const Vec3& axis, double radius, double start_angle,
                                    double turns, double t0, double t1, bool turn_with_path,
                                    int keyframes_per_turn) {
    require_finite("circular path centre", center);
    require_finite("circular path radius", radius);
    if (radius < 0) throw InputError("circular path radius", text(radius), "give 0 or more");
    require_finite("circular path start angle", start_angle);
    require_finite("circular path start time", t0);
    require_finite("circular path end time", t1);
    if (!(t1 > t0))
        throw InputError("circular path end time", text(t1) + " s does not come after " + text(t0) + " s");
    if (!(std::abs(turns) <= 1e5)) throw InputError("circular path turns", text(turns), "give at most 1e5");
    if (keyframes_per_turn < 4 || keyframes_per_turn > 4096)
        throw InputError("circular path keyframes per turn", std::to_string(keyframes_per_turn),
                         "give 4 to 4096");
    const Vec3 unit = direction_of(axis), x = angle_zero_about(axis), y = unit.cross(x);
    const int spans = std::max(1, static_cast<int>(std::ceil(std::abs(turns) * keyframes_per_turn)));
    std::vector<Keyframe> keys(static_cast<std::size_t>(spans) + 1);
    for (int k = 0; k <= spans; ++k) {
        const double fraction = static_cast<double>(k) / spans;
        const double passed = 2 * std::numbers::pi * turns * fraction;
        Keyframe& key = keys[static_cast<std::size_t>(k)];
        key.time = (1 - fraction) * t0 + fraction * t1;
        const double angle = start_angle + passed;
        key.position = center + radius * (std::cos(angle) * x + std::sin(angle) * y);
        if (turn_with_path) key.rotation = Quat(Eigen::AngleAxisd(passed, unit));
    }
    return keys;
}

Blade::Blade(std::string name, BladeShape shape, std::vector<Keyframe> keyframes, const BladeOptions& options)
    : name_(std::move(name)),
      shape_(std::move(shape)),
      keyframes_(std::move(keyframes)),
      interpolation_(options.interpolation) {
    const std::string where = "blade '" + name_ + "'";
    check_shape(where, shape_);
    check_keyframes(where, keyframes_);
    velocities_ = smooth_velocities(keyframes_);
    set_activity(options, keyframes_.back().time);
}

Blade::Blade(std::string name, BladeShape shape, SampledMotion path, const BladeOptions& options)
    : name_(std::move(name)), shape_(std::move(shape)), interpolation_(PathInterpolation::linear) {
    check_shape("blade '" + name_ + "'", shape_);
    if (path.empty()) throw InputError("blade '" + name_ + "'", "has no sample", "give at least one");
    for (std::size_t k = 0; k < path.times().size(); ++k) move_to(path.times()[k], path.frames()[k]);
    set_activity(options, std::numeric_limits<double>::infinity());
}

void Blade::move_to(double time, const Isometry& world_from_own) {
    if (samples_.empty() && !keyframes_.empty())
        throw InputError("blade '" + name_ + "'", "goes along keyframes", "make it with samples to move it");
    samples_.add(time, world_from_own);
    keyframes_.push_back({time, world_from_own.translation(), Quat(world_from_own.linear())});
}

void Blade::forget_before(double time) {
    const auto count = static_cast<std::ptrdiff_t>(samples_.forget_before(time));
    keyframes_.erase(keyframes_.begin(), keyframes_.begin() + count);
}

void Blade::set_active(double from, double until) {
    BladeOptions options;
    options.active_from = from;
    options.active_until = until;
    set_activity(options, until);
}

void Blade::set_activity(const BladeOptions& options, double last) {
    active_from_ = options.active_from.value_or(keyframes_.front().time);
    active_until_ = options.active_until.value_or(last);
    if (!(active_from_ <= active_until_))
        throw InputError("blade '" + name_ + "'",
                         "is active from " + text(active_from_) + " s until " + text(active_until_) + " s",
                         "end the interval after its beginning");
}

Vec3 Blade::position_at(std::size_t span, double fraction) const {
    const Keyframe &a = keyframes_[span], &b = keyframes_[span + 1];
    const double f = fraction, g = 1 - fraction;
    if (interpolation_ == PathInterpolation::linear) return g * a.position + f * b.position;
    const double length = b.time - a.time;
    return g * g * (1 + 2 * f) * a.position + f * f * (1 + 2 * g) * b.position +
           length * f * g * (g * velocities_[span] - f * velocities_[span + 1]);
}

Isometry Blade::frame(double time) const {
    if (!samples_.empty()) return samples_.at(time);
    Isometry out = Isometry::Identity();
    const auto make_frame = [&](const Vec3& position, const Quat& rotation) {
        out.linear() = rotation.toRotationMatrix();
        out.translation() = position;
        return out;
    };
    const auto after = std::upper_bound(keyframes_.begin(), keyframes_.end(), time,
                                        [](double t, const Keyframe& key) { return t < key.time; });
    if (after == keyframes_.begin())
        return make_frame(keyframes_.front().position, keyframes_.front().rotation);
    if (after == keyframes_.end()) return make_frame(keyframes_.back().position, keyframes_.back().rotation);
    const auto span = static_cast<std::size_t>(after - keyframes_.begin()) - 1;
    const Keyframe &a = keyframes_[span], &b = keyframes_[span + 1];
    if (time == a.time) return make_frame(a.position, a.rotation);
    const double fraction = (time - a.time) / (b.time - a.time);
    return make_frame(position_at(span, fraction), a.rotation.slerp(fraction, b.rotation).normalized());
}

std::vector<std::vector<Vec3>> Blade::pose(double time) const {
    const Isometry world_from_own = frame(time);
    std::vector<std::vector<Vec3>> out = shape_.polylines;
    for (std::vector<Vec3>& points : out)
        for (Vec3& point : points) point = world_from_own * point;
    return out;
}

}  // namespace splitcubes::cutting
