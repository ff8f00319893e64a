// Stiffness of the springs of ContactForces.
#include <splitcubes/contact/response/contact_forces.h>
#include <splitcubes/contact/response/tuning.h>

#include <algorithm>
#include <limits>

namespace splitcubes::meshless {

void ContactForces::add_mobility(const ContactSide& side, Mobility& sum) const {
    for (std::uint32_t k = 0; k < side.count; ++k) {
        const std::uint32_t i = side.phyxel[k];
        const Part& part = parts_[side.part];
        // Contacts that share a phyxel share its stiffness.
        const double shared = std::max(1.0, load_[side.part][i]);
        const double mobility = side.weight[k] * side.weight[k] * shared * part.mobility[i];
        sum.free += mobility;
        if (part.fixed.empty() || part.fixed[i] == 0) sum.actual += mobility;
    }
}

// Returns the mass of the piece of a side, kg; infinite for a collider and if it is not known.
double ContactForces::mass_of(const ContactSide& side) const {
    constexpr double infinite = std::numeric_limits<double>::infinity();
    if (side.is_collider()) return infinite;
    const Part& part = parts_[side.part];
    const std::int32_t piece = part.piece.empty() ? -1 : part.piece[side.phyxel[0]];
    return piece < 0 ? infinite : part.piece_mass[static_cast<std::size_t>(piece)];
}

// Returns the reduced mass of the pieces that touch over the squared time step, N/m; infinite for two sides
// of one piece.
double ContactForces::inertia(const Contact& contact) const {
    const ContactSide &upper = contact.upper, &lower = contact.lower;
    const Part& part = parts_[upper.part];
    const double inverse = 1 / mass_of(upper) + 1 / mass_of(lower);
    const bool is_inside = !lower.is_collider() && lower.part == upper.part && inverse > 0 &&
                           part.piece[upper.phyxel[0]] == part.piece[lower.phyxel[0]];
    return is_inside ? std::numeric_limits<double>::infinity() : 1 / (inverse * part.dt * part.dt);
}

// Returns the stiffness of a contact, N/m. hardest: by that of its phyxels. In stiff material that is
// thousands of times the inertia: which contacts push then depends on micrometres, and is not found in dozens
// of solves. A spring that holds what the pieces weigh is enough until the overlap shows a larger load.
double ContactForces::stiffness(const Contact& contact, const CachedContact* cached, double hardest) const {
    const double least = std::min(hardest, tuning::contact::inertia_ratio * inertia(contact));
    if (!cached || !(cached->stiffness > 0)) return least;
    const double overlap = cached->rest_at(contact).gap - contact.gap;
    const bool is_deep = overlap > tuning::contact::stiffening_overlap * contact.max_depenetration;
    return std::clamp((is_deep ? tuning::contact::stiffening : 1) * cached->stiffness, least, hardest);
}

}  // namespace splitcubes::meshless
