#include <splitcubes/contact/detection/contact_finder.h>
#include <splitcubes/contact/detection/piece_turns.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/splitting/pieces.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

namespace {

using meshless::Contact;
using meshless::ContactSide;
using meshless::Momenta;

bool is_between_pieces(const Contact& contact) {
    return !contact.lower.is_collider();
}

}  // namespace

// Returns the slot of a piece; the last one of a body is for phyxels without a piece.
std::uint32_t PieceTurns::slot(std::uint32_t part, std::int32_t piece) const {
    const std::uint32_t last = first_[part + 1] - 1;
    return piece < 0 ? last : std::min(first_[part] + static_cast<std::uint32_t>(piece), last);
}

std::uint32_t PieceTurns::slot(std::span<const BodyView> bodies, const ContactIsland& island,
                               const ContactSide& side) const {
    return slot(side.part, bodies[island.bodies[side.part]].phyxels.piece[side.phyxel[0]]);
}

// Joins pieces that may touch each other, and marks sets that anything else touches, holds or pulls.
void PieceTurns::group(std::span<const BodyView> bodies, const ContactIsland& island) {
    first_.assign(1, 0);
    for (const std::size_t b : island.bodies)
        first_.push_back(first_.back() + static_cast<std::uint32_t>(bodies[b].pieces.count()) + 1);
    sets_.reset(first_.back());
    is_bound_.assign(first_.back(), 0);
    for (const Contact& contact : island.contacts)
        if (is_between_pieces(contact))
            sets_.join(slot(bodies, island, contact.upper), slot(bodies, island, contact.lower));
    for (const Contact& contact : island.contacts)
        if (!is_between_pieces(contact)) is_bound_[sets_.find(slot(bodies, island, contact.upper))] = 1;
    for (std::uint32_t k = 0; k < island.bodies.size(); ++k) {
        const BodyView& body = bodies[island.bodies[k]];
        is_bound_[sets_.find(first_[k + 1] - 1)] = 1;
        for (std::size_t i = 0; i < body.phyxels.held.size(); ++i)
            if (body.phyxels.held[i] != 0) is_bound_[sets_.find(slot(k, body.phyxels.piece[i]))] = 1;
        for (std::uint32_t s = first_[k]; body.is_pulled && s < first_[k + 1]; ++s)
            is_bound_[sets_.find(s)] = 1;
    }
}

// Finds the rotations of free sets in the step, at the angular velocity that they start with.
void PieceTurns::measure(std::span<const BodyView> bodies, const ContactIsland& island, double dt,
                         const Parallel& parallel) {
    free_.clear();
    for (std::size_t k = 0; k < island.bodies.size(); ++k) {
        const BodyView& body = bodies[island.bodies[k]];
        meshless::momenta_of_pieces(body.phyxels, static_cast<int>(body.pieces.count()), momenta_, sums_,
                                    parallel);
        for (std::uint32_t p = 0; p < momenta_.size(); ++p) {
            const std::uint32_t root = sets_.find(first_[k] + p);
            if (is_bound_[root] == 0 && momenta_[p].mass > 0)
                free_.push_back({root, first_[k] + p, momenta_[p]});
        }
    }
    std::sort(free_.begin(), free_.end(), [](const Free& a, const Free& b) {
        return a.root != b.root ? a.root < b.root : a.slot < b.slot;
    });
    angle_.assign(first_.back(), Vec3::Zero());
    for (std::size_t begin = 0, end = 0; begin < free_.size(); begin = end) {
        group_.clear();
        for (; end < free_.size() && free_[end].root == free_[begin].root; ++end)
            group_.push_back(free_[end].momenta);
        const Momenta all = meshless::together(group_);
        const Vec3 angle = dt * meshless::angular_velocity(all.inertia, all.angular_momentum);
        if (angle.norm() < tuning::turns::max_angle) angle_[free_[begin].root] = angle;
    }
}

void PieceTurns::turn(std::span<const BodyView> bodies, double dt, const Parallel& parallel,
                      std::span<ContactIsland> islands) {
    for (ContactIsland& island : islands) {
        if (std::none_of(island.contacts.begin(), island.contacts.end(), is_between_pieces)) continue;
        group(bodies, island);
        const auto is_free = [&](const Contact& contact) {
            return is_between_pieces(contact) &&
                   is_bound_[sets_.find(slot(bodies, island, contact.upper))] == 0;
        };
        if (std::none_of(island.contacts.begin(), island.contacts.end(), is_free)) continue;
        measure(bodies, island, dt, parallel);
        position_.clear();
        for (const std::size_t b : island.bodies) position_.emplace_back(bodies[b].phyxels.position);
        for (Contact& contact : island.contacts) {
            if (!is_free(contact)) continue;
            const Vec3& angle = angle_[sets_.find(slot(bodies, island, contact.upper))];
            const double size = angle.norm();
            if (!(size > 0)) continue;
            const Vec3 between = side_value(contact.upper, position_) - side_value(contact.lower, position_);
            const Vec3 change = Eigen::AngleAxisd(size, angle / size) * between - between;
            if (change.allFinite()) contact.turn_displacement = change;
        }
    }
}

}  // namespace splitcubes::body
