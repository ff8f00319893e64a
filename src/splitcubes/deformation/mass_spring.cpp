#include <splitcubes/core/error.h>
#include <splitcubes/deformation/mass_spring.h>
#include <splitcubes/deformation/tuning.h>
#include <splitcubes/math/decompose.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace splitcubes::deformation {

namespace {

// Returns the corners of a face other than a diagonal's ends.
std::array<Vec3i, 2> between(const Vec3i& a, int u, int v, int sign) {
    Vec3i first = a, second = a;
    ++first[u];
    second[v] += sign;
    return {first, second};
}

}  // namespace

MassSpring::MassSpring(NodeSet nodes, const MassSpringSettings& settings)
    : nodes_(std::move(nodes)), settings_(settings) {
    if (!(settings.youngs_modulus > 0) || !std::isfinite(settings.youngs_modulus))
        throw InputError("mass-spring lattice", "the modulus must be above zero");
    if (!(settings.mass_damping >= 0) || !(settings.stiffness_damping >= 0))
        throw InputError("mass-spring lattice", "damping must not be negative");
    const std::size_t count = nodes_.coordinates.size();
    stiffness_ = 0.4 * settings.youngs_modulus * nodes_.rest.cell_size;
    mass_ = nodes_.mass / static_cast<double>(std::max<std::size_t>(1, count));
    node_index_.assign(static_cast<std::size_t>(nodes_.rest.node_count.cast<std::int64_t>().prod()), -1);
    const Vec3i& size = nodes_.rest.node_count;
    for (std::size_t n = 0; n < count; ++n) {
        const Vec3i& p = nodes_.coordinates[n];
        node_index_[static_cast<std::size_t>((p[2] * size[1] + p[1]) * size[0] + p[0])] =
            static_cast<std::int32_t>(n);
    }
    edge_.assign(count, {0, 0, 0});
    for (const NodeEdge& edge : nodes_.uncut_edges)
        edge_[edge.lower][static_cast<std::size_t>(edge.axis)] = 1;

    std::vector<std::vector<Spring>> rows(count);
    const auto join = [&](std::uint32_t a, std::uint32_t b) {
        const auto length = (nodes_.rest_position(a) - nodes_.rest_position(b)).norm();
        rows[a].push_back({b, length, true});
        rows[b].push_back({a, length, true});
    };
    for (std::uint32_t n = 0; n < count; ++n)
        for (int u = 0; u < 3; ++u) {
            if (edge_[n][static_cast<std::size_t>(u)]) {
                Vec3i upper = nodes_.coordinates[n];
                ++upper[u];
                join(n, static_cast<std::uint32_t>(node_at(upper)));
            }
            const int v = (u + 1) % 3;
            for (const int sign : {-1, 1}) {
                Vec3i far = nodes_.coordinates[n];
                ++far[u];
                far[v] += sign;
                const std::int32_t other = node_at(far);
                const auto paths = between(nodes_.coordinates[n], u, v, sign);
                const auto is_intact = [&](const Vec3i& by) {
                    return edge_is_intact(nodes_.coordinates[n], by) && edge_is_intact(by, far);
                };
                if (other >= 0 && (is_intact(paths[0]) || is_intact(paths[1])))
                    join(n, static_cast<std::uint32_t>(other));
            }
        }
    offsets_.push_back(0);
    for (auto& row : rows) {
        std::sort(row.begin(), row.end(), [](const Spring& a, const Spring& b) { return a.other < b.other; });
        springs_.insert(springs_.end(), row.begin(), row.end());
        offsets_.push_back(static_cast<std::uint32_t>(springs_.size()));
    }
    Vec3 centre = Vec3::Zero();
    for (std::size_t n = 0; n < count; ++n) {
        position_.push_back(nodes_.rest_position(n));
        centre += position_.back() / static_cast<double>(count);
    }
    for (const Vec3& p : position_)
        velocity_.emplace_back(nodes_.velocity + nodes_.angular_velocity.cross(p - centre));
    next_ = force_ = std::vector<Vec3>(count, Vec3::Zero());
    rotation_.assign(count, Mat3::Identity());
}

std::int32_t MassSpring::node_at(const Vec3i& position) const {
    if (!nodes_.rest.contains(position)) return -1;
    const Vec3i& size = nodes_.rest.node_count;
    return node_index_[static_cast<std::size_t>((position[2] * size[1] + position[1]) * size[0] +
                                                position[0])];
}

// Returns whether two neighbouring grid positions are nodes with an uncut edge between them.
bool MassSpring::edge_is_intact(const Vec3i& a, const Vec3i& b) const {
    const std::int32_t first = node_at(a), second = node_at(b);
    if (first < 0 || second < 0) return false;
    const Vec3i offset = b - a;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const int step = offset[static_cast<int>(axis)];
        if (step > 0) return edge_[static_cast<std::size_t>(first)][axis] != 0;
        if (step < 0) return edge_[static_cast<std::size_t>(second)][axis] != 0;
    }
    return false;
}

void MassSpring::remove(std::uint32_t a, std::uint32_t b) {
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)})
        for (std::uint32_t k = offsets_[from]; k < offsets_[from + 1]; ++k)
            if (springs_[k].other == to) springs_[k].is_intact = false;
}

// Removes the diagonals of the four faces at an edge that are no longer connected.
void MassSpring::remove_diagonals(const NodeEdge& edge) {
    const Vec3i low = nodes_.coordinates[edge.lower], high = nodes_.coordinates[edge.upper];
    for (int k = 0; k < 4; ++k) {
        Vec3i side = Vec3i::Zero();
        side[(edge.axis + 1 + (k & 1)) % 3] = k < 2 ? -1 : 1;
        const std::array<Vec3i, 4> ring = {low, high, high + side, low + side};
        for (std::size_t d = 0; d < 2; ++d) {
            const Vec3i &a = ring[d], &c = ring[d + 2], &b = ring[d + 1], &e = ring[(d + 3) % 4];
            const std::int32_t from = node_at(a), to = node_at(c);
            if (from < 0 || to < 0) continue;
            if ((edge_is_intact(a, b) && edge_is_intact(b, c)) ||
                (edge_is_intact(a, e) && edge_is_intact(e, c)))
                continue;
            remove(static_cast<std::uint32_t>(from), static_cast<std::uint32_t>(to));
        }
    }
}

void MassSpring::edges_cut(std::span<const NodeEdge> edges) {
    for (const NodeEdge& edge : edges) {
        edge_[edge.lower][static_cast<std::size_t>(edge.axis)] = 0;
        remove(edge.lower, edge.upper);
    }
    for (const NodeEdge& edge : edges) remove_diagonals(edge);
}

std::size_t MassSpring::spring_count() const {
    return static_cast<std::size_t>(
               std::count_if(springs_.begin(), springs_.end(), [](const Spring& s) { return s.is_intact; })) /
           2;
}

// Returns the spring force on a node. Both ends of a spring compute the same force with opposite sign, to the
// last bit.
Vec3 MassSpring::spring_force(std::size_t node) const {
    Vec3 force = Vec3::Zero();
    for (const Spring& s : springs_of(node)) {
        if (!s.is_intact) continue;
        const Vec3 offset = position_[s.other] - position_[node];
        const double length = offset.norm();
        if (!(length > 1e-9 * s.length)) continue;
        const Vec3 along = offset / length;
        const double rate = (velocity_[s.other] - velocity_[node]).dot(along);
        force += stiffness_ * (length - s.length + settings_.stiffness_damping * rate) * along;
    }
    return force;
}

void MassSpring::resolve_ground_contact(const Motion& motion, std::size_t node) {
    const Motion::Ground& g = *motion.ground;
    const double depth = g.offset - g.normal.dot(position_[node]);
    if (!(depth > 0)) return;
    position_[node] += depth * g.normal;
    const double speed = g.normal.dot(velocity_[node]);
    if (speed >= 0) return;
    Vec3 sliding = velocity_[node] - speed * g.normal;
    const double along = sliding.norm();
    if (along > 0) sliding *= std::max(0.0, 1 + g.friction * speed / along);
    velocity_[node] = sliding;
}

// Advances by one substep. share: part of the time step that has passed at its end.
void MassSpring::substep(const Motion& motion, double dt, double share) {
    const double kept = 1 / (1 + settings_.mass_damping * dt);
    motion.parallel.for_each(position_.size(), tuning::mass_spring::spring_grain,
                             [&](std::size_t n) { force_[n] = spring_force(n); });
    motion.parallel.for_each(position_.size(), tuning::mass_spring::spring_grain, [&](std::size_t n) {
        if (!motion.held.empty() && motion.held[n]) {
            const Vec3 to = next_[n] + share * (motion.held_position[n] - next_[n]);
            velocity_[n] = (to - position_[n]) / dt;
            position_[n] = to;
            return;
        }
        velocity_[n] = kept * (velocity_[n] + dt * (force_[n] / mass_ + motion.gravity));
        position_[n] += dt * velocity_[n];
        if (motion.ground) resolve_ground_contact(motion, n);
    });
}

MotionReport MassSpring::advance(const Motion& motion) {
    // A node has at most 6 + 12 springs. By Gershgorin's circles the largest eigenvalue of the stiffness is
    // at most 12 k; damping is as stiff as 24 c.
    const double frequency = std::sqrt(12 * stiffness_ / mass_);
    const double damping = 12 * stiffness_ * settings_.stiffness_damping / mass_;
    const double max_dt = tuning::mass_spring::stability_share * 2 / (frequency + damping);
    const int substeps = static_cast<int>(std::clamp(std::ceil(motion.dt / max_dt), 1.0, 1e6));
    const std::vector<Vec3> position_before = position_, velocity_before = velocity_;
    next_ = position_;
    for (int k = 0; k < substeps; ++k)
        substep(motion, motion.dt / substeps, static_cast<double>(k + 1) / substeps);
    MotionReport report;
    bool finite = true;
    for (std::size_t n = 0; n < position_.size(); ++n)
        if (!position_[n].allFinite() || !velocity_[n].allFinite()) {
            finite = false;
            position_[n] = position_before[n];
            velocity_[n] = Vec3::Zero();
        }
    report = describe(motion);
    report.substeps = substeps;
    report.finite = finite;
    return report;
}

MotionReport MassSpring::describe(const Motion& motion) const {
    MotionReport report;
    for (std::size_t n = 0; n < position_.size(); ++n) {
        report.momentum += mass_ * velocity_[n];
        report.angular_momentum += mass_ * position_[n].cross(velocity_[n]);
        report.kinetic_energy += 0.5 * mass_ * velocity_[n].squaredNorm();
        report.top_speed = std::max(report.top_speed, velocity_[n].norm());
        for (const Spring& s : springs_of(n)) {
            if (!s.is_intact) continue;
            const double stretch = (position_[s.other] - position_[n]).norm() - s.length;
            report.elastic_energy += 0.25 * stiffness_ * stretch * stretch;
        }
        if (motion.ground)
            report.contacts += motion.ground->normal.dot(position_[n]) <= motion.ground->offset + 1e-12;
    }
    return report;
}

void MassSpring::node_frames(std::span<geometry::Frame> out, const Parallel& parallel) const {
    const double min_moment = 0.3 * nodes_.rest.cell_size * nodes_.rest.cell_size;
    parallel.for_each(out.size(), tuning::mass_spring::spring_grain, [&](std::size_t n) {
        Mat3 moment = Mat3::Zero(), moved = Mat3::Zero();
        for (const Spring& s : springs_of(n)) {
            if (!s.is_intact) continue;
            const Vec3 rest = nodes_.rest_position(s.other) - nodes_.rest_position(n);
            moment += rest * rest.transpose();
            moved += (position_[s.other] - position_[n]) * rest.transpose();
        }
        out[n].position = position_[n];
        const bool spans = eigen_symmetric(moment).values[2] > min_moment;
        const Mat3 fit = spans ? Mat3(moved * moment.inverse()) : Mat3::Zero();
        rotation_[n] = rotation_of(spans ? fit : moved, rotation_[n]);
        out[n].jacobian = spans && fit.determinant() > 0 ? fit : rotation_[n];
    });
}

std::vector<double> MassSpring::state() const {
    std::vector<double> out;
    for (std::size_t n = 0; n < position_.size(); ++n) {
        out.insert(out.end(), position_[n].begin(), position_[n].end());
        out.insert(out.end(), velocity_[n].begin(), velocity_[n].end());
        for (const auto column : rotation_[n].colwise()) out.insert(out.end(), column.begin(), column.end());
    }
    return out;
}

void MassSpring::set_state(std::span<const double> state) {
    constexpr std::size_t each = 15;
    assert(state.size() == each * position_.size());
    for (std::size_t n = 0; n < position_.size(); ++n) {
        const double* const own = state.data() + each * n;
        position_[n] = Eigen::Map<const Vec3>(own);
        velocity_[n] = Eigen::Map<const Vec3>(own + 3);
        rotation_[n] = Eigen::Map<const Mat3>(own + 6);
    }
}

}  // namespace splitcubes::deformation
