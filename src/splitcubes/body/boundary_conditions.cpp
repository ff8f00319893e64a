#include <splitcubes/body/boundary_conditions.h>
#include <splitcubes/contact/response/contact.h>
#include <splitcubes/samples/phyxels.h>

#include <algorithm>

namespace splitcubes::body {

namespace {

// Returns whether a region acts on a phyxel: it contains it at time 0, and the phyxel does not ignore it.
template <class Region>
bool acts_on(const std::vector<Region>& regions, std::size_t r, const meshless::Phyxels& phyxels,
             std::span<const std::uint32_t> ignored, const Isometry& pose, std::size_t i) {
    return r >= ignored[i] && regions[r].region(pose * phyxels.rest_position[i]);
}

template <class Region>
bool any_acts_on(const std::vector<Region>& regions, const meshless::Phyxels& phyxels,
                 std::span<const std::uint32_t> ignored, const Isometry& pose, std::size_t i) {
    for (std::size_t r = 0; r < regions.size(); ++r)
        if (acts_on(regions, r, phyxels, ignored, pose, i)) return true;
    return false;
}

// Lists the phyxels on which each region acts; does nothing if there is a list per region.
template <class Region>
void list_phyxels_of(const std::vector<Region>& regions, const meshless::Phyxels& phyxels,
                     std::span<const std::uint32_t> ignored, const Isometry& pose,
                     std::vector<std::vector<std::uint32_t>>& out) {
    if (out.size() == regions.size()) return;
    out.assign(regions.size(), {});
    for (std::size_t r = 0; r < regions.size(); ++r)
        for (std::uint32_t i = 0; i < phyxels.size(); ++i)
            if (acts_on(regions, r, phyxels, ignored, pose, i)) out[r].push_back(i);
}

// Keeps the numbers of ignored regions right after one was removed.
void remove_region(std::size_t index, std::vector<std::uint32_t>& ignored) {
    for (std::uint32_t& count : ignored) count -= count > index;
}

}  // namespace

void BoundaryConditions::add_constraint(HoldConstraint constraint) {
    constraints_.push_back(std::move(constraint));
    constrained_.clear();
}

void BoundaryConditions::add_handle(Handle handle) {
    handles_.push_back(std::move(handle));
    handle_phyxels_.clear();
}

void BoundaryConditions::remove_constraint(std::size_t index, meshless::Phyxels& phyxels) {
    remove_region(index, phyxels.ignored_holds);
    constraints_.erase(constraints_.begin() + static_cast<std::ptrdiff_t>(index));
    constrained_.clear();
}

void BoundaryConditions::remove_handle(std::size_t index, meshless::Phyxels& phyxels) {
    remove_region(index, phyxels.ignored_handles);
    handles_.erase(handles_.begin() + static_cast<std::ptrdiff_t>(index));
    handle_phyxels_.clear();
}

void BoundaryConditions::forget_phyxels() {
    constrained_.clear();
    handle_phyxels_.clear();
}

std::vector<meshless::RigidKinematicTarget> BoundaryConditions::find_kinematic_rigid_pieces(
    const meshless::Phyxels& phyxels, double time, double dt) const {
    std::vector<meshless::RigidKinematicTarget> targets;
    std::vector<std::uint8_t> found(phyxels.rigid.bodies.size(), 0);
    if (found.empty()) return targets;
    for (std::size_t c = 0; c < constraints_.size(); ++c) {
        if (!constraints_[c].is_active(time)) continue;
        const Isometry motion = constraints_[c].motion(time + dt) * constraints_[c].motion(time).inverse();
        for (const std::uint32_t i : constrained_[c]) {
            const std::int32_t index = phyxels.rigid.index(phyxels.piece[i]);
            if (index < 0 || found[static_cast<std::size_t>(index)] != 0) continue;
            found[static_cast<std::size_t>(index)] = 1;
            targets.push_back({static_cast<std::size_t>(index), motion});
        }
    }
    return targets;
}

void BoundaryConditions::begin_step(const meshless::Phyxels& phyxels, double time, double dt,
                                    const Parallel& parallel) {
    list_phyxels_of(constraints_, phyxels, phyxels.ignored_holds, pose_, constrained_);
    held_.assign(phyxels.size(), 0);
    held_position_.resize(phyxels.size());
    parallel.for_each(phyxels.size(), 1024, [&](std::size_t i) { held_position_[i].setZero(); });
    for (std::size_t c = 0; c < constraints_.size(); ++c) {
        if (!constraints_[c].is_active(time)) continue;
        const Isometry motion = constraints_[c].motion(time + dt) * pose_;
        for (const std::uint32_t i : constrained_[c]) {
            held_[i] = 1;
            held_position_[i] = motion * phyxels.rest_position[i];
        }
    }
    kinematic_rigid_pieces_ = find_kinematic_rigid_pieces(phyxels, time, dt);
}

std::span<const std::uint8_t> BoundaryConditions::held_among(const meshless::Phyxels& phyxels, double time) {
    list_phyxels_of(constraints_, phyxels, phyxels.ignored_holds, pose_, constrained_);
    held_among_.assign(phyxels.size(), 0);
    for (std::size_t c = 0; c < constraints_.size(); ++c)
        if (constraints_[c].is_active(time))
            for (const std::uint32_t i : constrained_[c]) held_among_[i] = 1;
    return held_among_;
}

bool BoundaryConditions::is_held(const meshless::Phyxels& phyxels, std::size_t i) const {
    return any_acts_on(constraints_, phyxels, phyxels.ignored_holds, pose_, i);
}

bool BoundaryConditions::is_pulled(const meshless::Phyxels& phyxels, std::size_t i) const {
    return any_acts_on(handles_, phyxels, phyxels.ignored_handles, pose_, i);
}

double BoundaryConditions::hold_offset(const Vec3& rest, const Vec3& position, double time) const {
    double offset = 0;
    for (const HoldConstraint& constraint : constraints_)
        if (constraint.is_active(time) && constraint.region(pose_ * rest))
            offset = std::max(offset, (constraint.motion(time) * (pose_ * rest) - position).norm());
    return offset;
}

BoundaryConditions::HeldPoints BoundaryConditions::hold(std::span<const Vec3> rest_position, double time,
                                                        double dt) const {
    HeldPoints out;
    out.held.assign(rest_position.size(), 0);
    out.position.assign(rest_position.size(), Vec3::Zero());
    for (const HoldConstraint& constraint : constraints_) {
        if (!constraint.is_active(time)) continue;
        const Isometry motion = constraint.motion(time + dt) * pose_;
        for (std::size_t i = 0; i < rest_position.size(); ++i) {
            if (!constraint.region(pose_ * rest_position[i])) continue;
            out.held[i] = 1;
            out.position[i] = motion * rest_position[i];
        }
    }
    return out;
}

void BoundaryConditions::add_handle_springs(const meshless::Phyxels& phyxels, double time, double dt,
                                            std::uint32_t part,
                                            std::vector<meshless::HandleSpring>& handle_springs,
                                            std::vector<double>& limits) {
    list_phyxels_of(handles_, phyxels, phyxels.ignored_handles, pose_, handle_phyxels_);
    for (std::size_t h = 0; h < handles_.size(); ++h) {
        const Handle& handle = handles_[h];
        const auto limit_index = static_cast<std::uint32_t>(limits.size());
        limits.push_back(handle.limit);
        if (!handle.is_active(time)) continue;
        const Isometry start = handle.motion(time) * pose_, motion = handle.motion(time + dt) * pose_;
        double mass = 0;
        for (const std::uint32_t i : handle_phyxels_[h]) mass += phyxels.mass[i];
        if (!(mass > 0)) continue;
        for (const std::uint32_t i : handle_phyxels_[h]) {
            const double stiffness = handle.stiffness * phyxels.mass[i] / mass;
            if (stiffness > 0)
                handle_springs.push_back({part, i, limit_index, motion * phyxels.rest_position[i], stiffness,
                                          start * phyxels.rest_position[i]});
        }
    }
}

}  // namespace splitcubes::body
