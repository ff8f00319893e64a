// Attachment springs of handles among the springs of a step.
#include <splitcubes/contact/response/contact_forces.h>
#include <splitcubes/contact/response/tuning.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::meshless {

// Scales the springs of each handle so that their summed force stays within its limit. Returns whether
// stiffnesses changed.
bool ContactForces::revise_handle_springs(ConstField position) {
    handle_forces_.assign(input_.handle_force_limits.size(), Vec3::Zero());
    const auto stretch = [&](const HandleRow& s) {
        return Vec3(s.given.target - position[s.given.part][s.given.phyxel]);
    };
    for (const HandleRow& s : handle_springs_)
        handle_forces_[s.given.handle] += s.given.stiffness * stretch(s);
    bool changed = false;
    for (HandleRow& s : handle_springs_) {
        const double scaled_stiffness =
            s.given.stiffness *
            share_within_limit(handle_forces_[s.given.handle], input_.handle_force_limits[s.given.handle]);
        changed = changed ||
                  std::abs(scaled_stiffness - s.stiffness) > tuning::contact::force_slack * scaled_stiffness;
        s.stiffness = scaled_stiffness;
    }
    return changed;
}

// Returns the work of the handles on the phyxels in the step, J: the larger one by their forces before and
// after it. A step of second order uses forces between.
double ContactForces::work_of_handles(ConstField position) {
    handle_forces_.assign(input_.handle_force_limits.size(), Vec3::Zero());  // N, before the step
    const auto force_before = [&](const HandleRow& s) {
        return Vec3(s.given.stiffness * (s.given.start_target - parts_[s.given.part].start[s.given.phyxel]));
    };
    for (const HandleRow& s : handle_springs_) handle_forces_[s.given.handle] += force_before(s);
    double before = 0, after = 0;
    for (const HandleRow& s : handle_springs_) {
        const double share =
            share_within_limit(handle_forces_[s.given.handle], input_.handle_force_limits[s.given.handle]);
        const Vec3& end = position[s.given.part][s.given.phyxel];
        const Vec3 displacement = end - parts_[s.given.part].start[s.given.phyxel];
        before += share * force_before(s).dot(displacement);
        after += s.stiffness * (s.given.target - end).dot(displacement);
    }
    return std::max(before, after);
}

}  // namespace splitcubes::meshless
