// The part of ImplicitSolver that keeps phyxels above the ground: an active set.
#include <splitcubes/meshless/solver.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::meshless {

namespace {

// Share of a depth that a phyxel found below the plane is lifted by in a step.
constexpr double lift_share = 0.2;
// Depth below the plane, in contact radii, that does not ask for another solve.
constexpr double contact_slack = 1e-6;
// Relative change of a sliding phyxel's friction that asks for another solve.
constexpr double friction_slack = 0.1;

}  // namespace

// Binds phyxel i to the plane, where it would have reached `reached`. It starts as
// sticking or sliding by what its own momentum says (a sliding body that is held
// for the first solve would tip over); the solves decide. Returns its place.
Vec3 ImplicitSolver::touch_ground(const Job& job, std::size_t i, const Vec3& reached) {
    const GroundPlane& ground = *job.input.ground;
    const Vec3& normal = ground.normal;
    const double radius = job.phyxels.contact_radius[i];
    const auto gap_at = [&](const Vec3& x) { return normal.dot(x) - ground.offset - radius; };
    const Vec3& before = start_position_[i];
    const Vec3 way = reached - before;
    const double fall = std::max(-normal.dot(way), 0.0);
    const Vec3 slip = way + normal * fall;
    const bool sticks = ground.friction > 0 && slip.norm() <= ground.friction * fall;
    // One that was already below is lifted gently: a jump would make energy.
    const double gap = std::min(gap_at(before), 0.0) * (1 - lift_share);
    const Vec3& along = sticks ? before : reached;
    const Vec3 place = along + normal * (gap - gap_at(along));
    mode_[i] = sticks ? Mode::stick : Mode::slide;
    touched_[i] = 1;
    friction_[i].setZero();
    if (!sticks && slip.norm() > 0)
        friction_[i] = -slip.normalized() * (ground.friction * diagonal_[i] * normal.dot(place - reached));
    return place;
}

bool ImplicitSolver::below_ground(const Job& job, std::size_t i, const Vec3& place) const {
    if (!job.input.ground) return false;
    const double radius = job.phyxels.contact_radius[i];
    return job.input.ground->normal.dot(place) - job.input.ground->offset - radius < -contact_slack * radius;
}

void ImplicitSolver::meet_ground(const Job& job) {
    if (!job.input.ground) return;
    const GroundPlane& ground = *job.input.ground;
    for_phyxels(job.parallel, job.phyxels.size(), [&](std::size_t i) {
        if (mode_[i] != Mode::free) return;
        const double gap = ground.normal.dot(predicted_[i]) - ground.offset - job.phyxels.contact_radius[i];
        if (gap < 0) base_[i] = touch_ground(job, i, predicted_[i]);
    });
}

// Compares each contact with the reaction that the solve asks of it. Returns
// whether any has changed, so that the solve is to be repeated.
bool ImplicitSolver::revise_contacts(const Job& job) {
    if (!job.input.ground) return false;
    const std::size_t n = job.phyxels.size();
    const double factor = 1 + damping_ratio(job);
    elastic_.apply_stiffness(factor, diagonal_, d_, q_, job.parallel);
    return sum_(job.parallel, n, [&](std::size_t begin, std::size_t end) {
               double changes = 0;
               for (std::size_t i = begin; i < end; ++i) changes += revise_contact(job, i);
               return changes;
           }) > 0;
}

bool ImplicitSolver::revise_contact(const Job& job, std::size_t i) {
    const GroundPlane& ground = *job.input.ground;
    const Vec3& normal = ground.normal;
    const Vec3 reached = base_[i] + d_[i];
    if (mode_[i] == Mode::held || failed_[i] != 0) return false;
    if (mode_[i] == Mode::free) {
        if (!below_ground(job, i, reached)) return false;
        d_[i] = touch_ground(job, i, reached) - base_[i];
        return true;
    }
    const Vec3 reaction = q_[i] - right_[i];
    const double pressure = normal.dot(reaction);
    if (pressure < 0) {
        mode_[i] = Mode::free;
        friction_[i].setZero();
        return true;
    }
    const double limit = ground.friction * pressure;
    if (mode_[i] == Mode::stick) {
        const Vec3 tangential = reaction - normal * pressure;
        if (!(tangential.norm() > limit)) return false;
        mode_[i] = Mode::slide;
        friction_[i] = tangential.normalized() * limit;
        return true;
    }
    if (ground.friction == 0) return false;
    const Vec3 slip = reached - start_position_[i];
    const double old = friction_[i].norm();
    if (slip.dot(friction_[i]) > 0) {
        // Friction has turned the phyxel round: it sticks after all.
        mode_[i] = Mode::stick;
        d_[i] -= slip - normal * normal.dot(slip);
        friction_[i].setZero();
        return true;
    }
    if (old > 0)
        friction_[i] *= limit / old;
    else if (slip.norm() > 0)
        friction_[i] = (normal * normal.dot(slip) - slip).normalized() * limit;
    return std::abs(limit - old) > friction_slack * old;
}

}  // namespace splitcubes::meshless
