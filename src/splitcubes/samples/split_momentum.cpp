#include <splitcubes/samples/split_momentum.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::meshless {

SplitMomentum::SplitMomentum(const Phyxels& phyxels, std::vector<std::int32_t> family,
                             std::span<const std::uint8_t> held)
    : family_(std::move(family)) {
    before_ = of_families(phyxels);
    energy_ = energy_of_families(phyxels);
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

std::vector<double> SplitMomentum::energy_of_families(const Phyxels& phyxels) const {
    std::vector<double> out(before_.size(), 0);
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const std::int32_t family = family_of(phyxels.piece[i]);
        if (family >= 0 && phyxels.rigid.index(phyxels.piece[i]) < 0)
            out[static_cast<std::size_t>(family)] +=
                0.5 * phyxels.mass[i] * phyxels.velocity[i].squaredNorm();
    }
    for (const RigidPiece& body : phyxels.rigid.bodies) {
        const std::int32_t family = family_of(body.piece);
        if (family >= 0) out[static_cast<std::size_t>(family)] += body.kinetic_energy();
    }
    return out;
}

void SplitMomentum::settle(Phyxels& phyxels) const {
    restore_momenta(phyxels);
    limit_energy(phyxels);
}

void SplitMomentum::limit_energy(Phyxels& phyxels) const {
    struct Motion {
        Vec3 centre, velocity, angular_velocity;  // m, m/s, rad/s
        double share = 1;                         // that stays of the deviations from it
    };
    const std::vector<Momenta> now = of_families(phyxels);
    const std::vector<double> energy = energy_of_families(phyxels);
    std::vector<Motion> motions(now.size());
    for (std::size_t k = 0; k < now.size(); ++k) {
        if (!(now[k].mass > 0) || !(energy[k] > energy_[k])) continue;
        Motion& motion = motions[k];
        motion = {now[k].centre, now[k].linear / now[k].mass,
                  angular_velocity(now[k].inertia, now[k].angular_momentum)};
        const double rigid =
            0.5 * (now[k].linear.dot(motion.velocity) + now[k].angular_momentum.dot(motion.angular_velocity));
        const double deviating = energy[k] - rigid;
        if (deviating > 0) motion.share = std::sqrt(std::clamp((energy_[k] - rigid) / deviating, 0.0, 1.0));
    }
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const std::int32_t family = family_of(phyxels.piece[i]);
        if (family < 0 || phyxels.rigid.index(phyxels.piece[i]) >= 0) continue;
        const Motion& motion = motions[static_cast<std::size_t>(family)];
        if (motion.share == 1) continue;
        const Vec3 rigid =
            motion.velocity + motion.angular_velocity.cross(phyxels.position[i] - motion.centre);
        phyxels.velocity[i] = rigid + motion.share * (phyxels.velocity[i] - rigid);
    }
    for (RigidPiece& body : phyxels.rigid.bodies) {
        const std::int32_t family = family_of(body.piece);
        if (family < 0) continue;
        const Motion& motion = motions[static_cast<std::size_t>(family)];
        if (motion.share == 1) continue;
        const Vec3 momentum =
            body.mass * (motion.velocity + motion.angular_velocity.cross(body.centre - motion.centre));
        const Vec3 angular_momentum = body.world_inertia() * motion.angular_velocity;
        body.momentum = momentum + motion.share * (body.momentum - momentum);
        body.angular_momentum = angular_momentum + motion.share * (body.angular_momentum - angular_momentum);
    }
}

void SplitMomentum::restore_momenta(Phyxels& phyxels) const {
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
        const std::int32_t family = family_of(piece);
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
        body.angular_momentum += body.world_inertia() * change->angular_velocity;
    }
}

}  // namespace splitcubes::meshless
