// Colliders that support elastic pieces: fragments do not push a piece into them.
#include <splitcubes/contact/detection/rigid_contacts.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/samples/phyxels.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

// Lists where colliders touch the elastic pieces that fragments meet. islands: contacts of this step.
void RigidContacts::list_supports(std::span<const ContactIsland> islands) {
    if (proxies_.empty()) return;
    std::vector<std::vector<std::int32_t>> proxy_of_piece(phyxels_.size());  // -1: none
    for (std::size_t k = 0; k < proxies_.size(); ++k) {
        std::vector<std::int32_t>& of_body = proxy_of_piece[proxies_[k].body];
        const auto piece = static_cast<std::size_t>(proxies_[k].piece);
        if (of_body.size() <= piece) of_body.resize(piece + 1, -1);
        of_body[piece] = static_cast<std::int32_t>(k);
    }
    for (const ContactIsland& island : islands)
        for (const meshless::Contact& contact : island.contacts) {
            if (!contact.lower.is_collider()) continue;
            const std::size_t body = island.bodies[contact.upper.part];
            const auto piece = static_cast<std::size_t>(phyxels_[body]->piece[contact.upper.phyxel[0]]);
            if (piece >= proxy_of_piece[body].size() || proxy_of_piece[body][piece] < 0) continue;
            Support support;
            support.proxy = static_cast<std::uint32_t>(proxy_of_piece[body][piece]);
            support.side = contact.upper;
            support.side.part = static_cast<std::uint32_t>(body);
            support.normal = contact.normal;
            support.is_moving = !contact.surface_displacement.isZero(0);
            const Vec3 start = meshless::side_value(support.side, positions_);
            support.offset = contact.gap - contact.normal.dot(start + contact.surface_displacement);
            if (std::isfinite(support.offset)) supports_.push_back(support);
        }
}

// Measures the gaps of the supports after the step.
void RigidContacts::measure_supports() {
    for (Support& support : supports_)
        support.gap = support.offset + support.normal.dot(meshless::side_value(support.side, positions_));
}

// Lifts pieces out of colliders as far as fragments pushed them in. Returns whether there was one.
bool RigidContacts::lift_from_supports() {
    bool any = false;
    for (const Support& support : supports_) {
        const PieceProxy& proxy = proxies_[support.proxy];
        if (proxy.held || !(proxy.mass > 0)) continue;
        const double correction = std::min(support.gap, 0.0) - support.gap - support.normal.dot(proxy.shift);
        if (!(correction > tuning::fragments::negligible_share * spacing_)) continue;
        const auto mover = static_cast<std::uint32_t>(fragments_.size()) + support.proxy;
        shift(mover, correction * support.normal);
        max_correction_ = std::max(max_correction_, correction);
        if (support.is_moving) groups_[group_of_[mover]].is_driven = true;
        any = true;
    }
    return any;
}

}  // namespace splitcubes::body
