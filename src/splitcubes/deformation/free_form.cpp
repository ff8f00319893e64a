#include <splitcubes/core/error.h>
#include <splitcubes/deformation/free_form.h>
#include <splitcubes/deformation/tuning.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace splitcubes::deformation {

namespace {

constexpr int max_degree = 12;

std::size_t point_count(const Vec3i& degree) {
    return static_cast<std::size_t>((degree[0] + 1) * (degree[1] + 1) * (degree[2] + 1));
}

// Bernstein polynomials of a degree at u, and their derivatives by u.
struct Bernstein {
    std::array<double, max_degree + 1> value{}, slope{};

    Bernstein(int degree, double u) {
        // De Casteljau's recursion; the slopes come from the polynomials of one degree less.
        value[0] = 1;
        for (int d = 1; d <= degree; ++d) {
            if (d == degree)
                for (int i = 0; i <= degree; ++i)
                    slope[at(i)] =
                        degree * ((i > 0 ? value[at(i - 1)] : 0) - (i < degree ? value[at(i)] : 0));
            for (int i = d; i >= 0; --i)
                value[at(i)] = (i < d ? (1 - u) * value[at(i)] : 0) + (i > 0 ? u * value[at(i - 1)] : 0);
        }
    }
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }
};

}  // namespace

void check_free_form(const FreeFormSettings& s) {
    if ((s.degree.array() < 1).any() || (s.degree.array() > max_degree).any())
        throw InputError("free form", "degrees must be from 1 to 12");
    if (s.keyframes.empty()) throw InputError("free form", "there must be a keyframe");
    for (std::size_t k = 0; k < s.keyframes.size(); ++k) {
        if (k > 0 && !(s.keyframes[k].time > s.keyframes[k - 1].time))
            throw InputError("free form", "keyframes must come by increasing time");
        if (s.keyframes[k].displacement.size() != point_count(s.degree))
            throw InputError("free form", "a keyframe must have a displacement for each control point");
        for (const Vec3& d : s.keyframes[k].displacement)
            if (!d.allFinite()) throw InputError("free form", "displacements must be finite");
    }
}

FreeForm::FreeForm(NodeSet nodes, FreeFormSettings settings, const geometry::Box& box)
    : nodes_(std::move(nodes)), settings_(std::move(settings)), box_(box) {
    check_free_form(settings_);
    displacement_ = displacement_at(0);
}

std::vector<Vec3> FreeForm::displacement_at(double time) const {
    const auto& keys = settings_.keyframes;
    const auto after = std::upper_bound(keys.begin(), keys.end(), time,
                                        [](double t, const LatticeKeyframe& k) { return t < k.time; });
    if (after == keys.begin()) return keys.front().displacement;
    if (after == keys.end()) return keys.back().displacement;
    const LatticeKeyframe &a = *(after - 1), &b = *after;
    const double s = (time - a.time) / (b.time - a.time), share = s * s * (3 - 2 * s);
    std::vector<Vec3> out(a.displacement.size());
    for (std::size_t k = 0; k < out.size(); ++k)
        out[k] = a.displacement[k] + share * (b.displacement[k] - a.displacement[k]);
    return out;
}

// Sums the displacements only: the undisplaced lattice gives the identity (linear precision).
geometry::Frame FreeForm::frame_of(const Vec3& rest, std::span<const Vec3> displacement) const {
    const Vec3 size = box_.size();
    const Vec3 u = (rest - box_.min).cwiseQuotient(size);
    const Bernstein x(settings_.degree[0], u[0]), y(settings_.degree[1], u[1]), z(settings_.degree[2], u[2]);
    Vec3 shift = Vec3::Zero();
    Mat3 gradient = Mat3::Zero();
    std::size_t point = 0;
    for (std::size_t k = 0; k <= static_cast<std::size_t>(settings_.degree[2]); ++k)
        for (std::size_t j = 0; j <= static_cast<std::size_t>(settings_.degree[1]); ++j)
            for (std::size_t i = 0; i <= static_cast<std::size_t>(settings_.degree[0]); ++i) {
                const Vec3& d = displacement[point++];
                shift += x.value[i] * y.value[j] * z.value[k] * d;
                gradient.col(0) += x.slope[i] * y.value[j] * z.value[k] / size[0] * d;
                gradient.col(1) += x.value[i] * y.slope[j] * z.value[k] / size[1] * d;
                gradient.col(2) += x.value[i] * y.value[j] * z.slope[k] / size[2] * d;
            }
    geometry::Frame out;
    out.position = rest + shift;
    out.jacobian = Mat3::Identity() + gradient;
    return out;
}

geometry::Frame FreeForm::frame_at(const Vec3& rest, double time) const {
    return frame_of(rest, displacement_at(time));
}

void FreeForm::edges_cut(std::span<const NodeEdge>) {}

MotionReport FreeForm::advance(const Motion& motion) {
    const std::vector<Vec3> before = displacement_;
    time_ = motion.time + motion.dt;
    displacement_ = displacement_at(time_);
    MotionReport report;
    const double mass =
        nodes_.mass / static_cast<double>(std::max<std::size_t>(1, nodes_.coordinates.size()));
    for (std::size_t n = 0; n < nodes_.coordinates.size(); ++n) {
        const Vec3 rest = nodes_.rest_position(n);
        const Vec3 now = frame_of(rest, displacement_).position;
        const Vec3 velocity = (now - frame_of(rest, before).position) / motion.dt;
        report.momentum += mass * velocity;
        report.angular_momentum += mass * now.cross(velocity);
        report.kinetic_energy += 0.5 * mass * velocity.squaredNorm();
        report.top_speed = std::max(report.top_speed, velocity.norm());
    }
    return report;
}

void FreeForm::node_frames(std::span<geometry::Frame> out, const Parallel& parallel) const {
    parallel.for_each(out.size(), tuning::free_form::point_grain,
                      [&](std::size_t n) { out[n] = frame_of(nodes_.rest_position(n), displacement_); });
}

std::vector<double> FreeForm::state() const {
    return {time_};
}

void FreeForm::set_state(std::span<const double> state) {
    assert(state.size() == 1);
    time_ = state[0];
    displacement_ = displacement_at(time_);
}

}  // namespace splitcubes::deformation
