#include <splitcubes/contact/response/contact_impulses.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::meshless {

void ContactImpulses::begin(const ContactInput& input, std::span<const Part> parts, double dt) {
    input_ = input;
    dt_ = dt;
    parts_.assign(parts.begin(), parts.end());
    rows_.clear();
    CachedContactFinder finder(input.cached);
    for (std::uint32_t c = 0; c < input.contacts.size(); ++c) {
        const Contact& contact = input.contacts[c];
        ImpulseRow row;
        row.contact = c;
        row.max_depenetration = finder.find(contact.key) ? contact.max_depenetration : 0;
        double sign = 1;
        for (const ContactSide* side : {&contact.upper, &contact.lower}) {
            for (std::uint32_t k = 0; k < side->count; ++k) {
                const Part& part = parts_[side->part];
                const std::uint32_t i = side->phyxel[k];
                row.start += sign * side->weight[k] * part.start[i];
                if (part.fixed[i] == 0)
                    row.mobility += side->weight[k] * side->weight[k] / part.effective_mass[i];
            }
            sign = -1;
        }
        if (row.mobility > 0) rows_.push_back(row);
    }
    if (input_.handle_forces) input_.handle_forces->assign(input_.handle_force_limits.size(), Vec3::Zero());
}

// Adds impulse times inverse mass to `field`, on both sides.
void ContactImpulses::apply_impulse(const ImpulseRow& row, const Vec3& impulse, Field field) const {
    const Contact& contact = input_.contacts[row.contact];
    double sign = 1;
    for (const ContactSide* side : {&contact.upper, &contact.lower}) {
        const Part& part = parts_[side->part];
        for (std::uint32_t k = 0; k < side->count; ++k) {
            const std::uint32_t i = side->phyxel[k];
            if (part.fixed[i] == 0)
                field[side->part][i] += sign * side->weight[k] / part.effective_mass[i] * impulse;
        }
        sign = -1;
    }
}

void ContactImpulses::separate_points(Field position, double done) {
    for (ImpulseRow& row : rows_) {
        const Contact& contact = input_.contacts[row.contact];
        const Vec3 displacement = side_value(contact.upper, position) - side_value(contact.lower, position) -
                                  row.start - done * contact.surface_displacement;
        // An initial overlap is removed gradually over the step; a jump would create energy.
        const double rest_gap = std::min(contact.gap + done * row.max_depenetration, 0.0);
        const double gap = contact.gap + contact.normal.dot(displacement);
        row.touches = gap < rest_gap;
        if (!row.touches || !std::isfinite(gap)) continue;
        row.touched = true;
        apply_impulse(row, (rest_gap - gap) / row.mobility * contact.normal, position);
    }
}

void ContactImpulses::stop(Field velocity) {
    for (ImpulseRow& row : rows_) {
        if (!row.touches) continue;
        const Contact& contact = input_.contacts[row.contact];
        const Vec3 velocity_difference = side_value(contact.upper, velocity) -
                                         side_value(contact.lower, velocity) -
                                         contact.surface_displacement / dt_;
        const double approach = -contact.normal.dot(velocity_difference);
        if (!(approach > 0)) continue;
        const Vec3 sliding = velocity_difference + approach * contact.normal;
        const double speed = sliding.norm();
        const double removed = std::min(contact.friction * approach, speed);
        Vec3 impulse = approach / row.mobility * contact.normal;
        if (speed > 0) impulse -= removed / speed / row.mobility * sliding;
        row.impulse += impulse;
        apply_impulse(row, impulse, velocity);
    }
}

void ContactImpulses::finish(std::span<const std::span<std::uint8_t>> touching) {
    next_.clear();
    for (const ImpulseRow& row : rows_) {
        if (!row.touched) continue;
        const Contact& contact = input_.contacts[row.contact];
        const Vec3 force = row.impulse / dt_;
        next_.push_back({contact.key, Vec3::Zero(), contact.normal.dot(force), force, 0, 0});
        for (const ContactSide* side : {&contact.upper, &contact.lower})
            for (std::uint32_t k = 0; k < side->count; ++k) touching[side->part][side->phyxel[k]] = 1;
    }
    if (input_.cached) input_.cached->swap(next_);
}

void ContactImpulses::add_handle_springs(ConstField position, Field force) {
    std::vector<Vec3> total(input_.handle_force_limits.size(), Vec3::Zero());
    const auto force_of = [&](const HandleSpring& p) {
        return Vec3(p.stiffness * (p.target - position[p.part][p.phyxel]));
    };
    for (const HandleSpring& p : input_.handle_springs) total[p.handle] += force_of(p);
    for (const HandleSpring& p : input_.handle_springs) {
        const double size = total[p.handle].norm(), limit = input_.handle_force_limits[p.handle];
        force[p.part][p.phyxel] += (size > limit ? limit / size : 1) * force_of(p);
    }
    if (!input_.handle_forces) return;
    for (std::size_t h = 0; h < total.size(); ++h) {
        const double size = total[h].norm(), limit = input_.handle_force_limits[h];
        (*input_.handle_forces)[h] = (size > limit ? limit / size : 1) * total[h];
    }
}

}  // namespace splitcubes::meshless
