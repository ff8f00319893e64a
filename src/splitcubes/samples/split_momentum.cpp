#include <splitcubes/samples/split_momentum.h>

#include <algorithm>

namespace splitcubes::meshless {

SplitMomentum::SplitMomentum(const Phyxels& phyxels, std::vector<std::int32_t> family,
                             std::span<const std::uint8_t> held)
    : family_(std::move(family)) {
    before_ = of_families(phyxels);
    moves_.resize(before_.size());
    for (std::size_t k = 0; k < before_.size(); ++k)
        moves_[k] = !before_[k].linear.isZero(0) || !before_[k].angular_momentum.isZero(0);
    for (std::size_t i = 0; i < held.size(); ++i) {
        const std::int32_t of = family_[static_cast<std::size_t>(phyxels.piece[i])];
        if (held[i] != 0 && of >= 0) moves_[static_cast<std::size_t>(of)] = 0;
    }
}

std::vector<Momenta> SplitMomentum::of_families(const Phyxels& phyxels) const {
    std::vector<Momenta> pieces;
    momenta_of_pieces(phyxels, static_cast<int>(family_.size()), pieces);
    std::int32_t count = 0;
    for (const std::int32_t family : family_) count = std::max(count, family + 1);
    std::vector<std::vector<Momenta>> parts(static_cast<std::size_t>(count));
    for (std::size_t k = 0; k < family_.size(); ++k)
        if (family_[k] >= 0 && pieces[k].mass > 0)
            parts[static_cast<std::size_t>(family_[k])].push_back(pieces[k]);
    std::vector<Momenta> out;
    for (const std::vector<Momenta>& of_one : parts) out.push_back(together(of_one));
    return out;
}

void SplitMomentum::settle(Phyxels& phyxels) const {
    struct Change {
        Vec3 centre, translation, velocity, angular_velocity;  // m, m, m/s, rad/s
    };
    const std::vector<Momenta> after = of_families(phyxels);
    std::vector<Change> changes;
    for (std::size_t k = 0; k < after.size(); ++k) {
        Change change{after[k].centre, Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
        if (after[k].mass > 0 && before_[k].mass > 0) {
            // Divided by each mass: the lumped totals may differ by rounding.
            if (moves_[k] != 0) change.translation = before_[k].centre - after[k].centre;
            change.velocity = before_[k].linear / before_[k].mass - after[k].linear / after[k].mass;
            change.angular_velocity =
                angular_velocity(after[k].inertia, before_[k].angular_momentum - after[k].angular_momentum);
        }
        changes.push_back(change);
    }
    const auto change_of = [&](std::int32_t piece) -> const Change* {
        if (piece < 0 || static_cast<std::size_t>(piece) >= family_.size()) return nullptr;
        const std::int32_t family = family_[static_cast<std::size_t>(piece)];
        return family < 0 ? nullptr : &changes[static_cast<std::size_t>(family)];
    };
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const Change* change = change_of(phyxels.piece[i]);
        if (change == nullptr || phyxels.rigid.index(phyxels.piece[i]) >= 0) continue;
        phyxels.velocity[i] +=
            change->velocity + change->angular_velocity.cross(phyxels.position[i] - change->centre);
        phyxels.position[i] += change->translation;
        phyxels.previous_position[i] += change->translation;
    }
    for (RigidPiece& body : phyxels.rigid.bodies) {
        const Change* change = change_of(body.piece);
        if (change == nullptr) continue;
        body.momentum +=
            body.mass * (change->velocity + change->angular_velocity.cross(body.centre - change->centre));
        body.centre += change->translation;
        body.angular_momentum +=
            body.rotation * body.inertia * body.rotation.transpose() * change->angular_velocity;
    }
}

}  // namespace splitcubes::meshless
