#include <splitcubes/dynamics/finite_rotations.h>
#include <splitcubes/math/decompose.h>

#include <cmath>

namespace splitcubes::meshless {

namespace {

std::size_t slot_of(std::int32_t piece, std::size_t slots) {
    return piece >= 0 && static_cast<std::size_t>(piece) + 1 < slots ? static_cast<std::size_t>(piece)
                                                                     : slots - 1;
}

}  // namespace

void FiniteRotations::find_motions(const Phyxels& phyxels, std::span<const std::uint8_t> held,
                                   std::span<const Vec3> x, std::span<const Vec3> u) {
    for (std::size_t i = 0; i < u.size(); ++i) {
        Motion& motion = motion_[slot_of(phyxels.piece[i], motion_.size())];
        motion.is_held |= held[i] != 0;
        motion.mass += phyxels.mass[i];
        motion.volume += phyxels.volume[i];
        motion.centre += phyxels.mass[i] * x[i];
        motion.shift += phyxels.mass[i] * u[i];
    }
    motion_.back().is_held = true;
    for (Motion& motion : motion_) {
        motion.is_held |= !(motion.mass > 0);
        if (motion.is_held) continue;
        motion.centre /= motion.mass;
        motion.shift /= motion.mass;
    }
    for (std::size_t i = 0; i < u.size(); ++i) {
        Motion& motion = motion_[slot_of(phyxels.piece[i], motion_.size())];
        if (motion.is_held) continue;
        const Vec3 arm = x[i] - motion.centre;
        motion.angle += phyxels.mass[i] * arm.cross(u[i] - motion.shift);
        motion.inertia += phyxels.mass[i] * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
    }
}

void FiniteRotations::apply(const Phyxels& phyxels, const Material& material, int piece_count,
                            std::span<const std::uint8_t> held, std::span<const Vec3> x, std::span<Vec3> u,
                            const Parallel& parallel) {
    motion_.assign(static_cast<std::size_t>(piece_count) + 1, Motion{});
    find_motions(phyxels, held, x, u);
    // A stretch e of both directions across the axis has the energy 2 (mu + lambda + k) e^2 a volume.
    const double modulus = material.lame_mu() + material.lame_lambda() + material.volume_stiffness;
    stretch_energy_ = 0;
    for (Motion& motion : motion_) {
        if (motion.is_held) continue;
        motion.angle = angular_velocity(motion.inertia, motion.angle);
        const double angle = motion.angle.norm();
        if (!(angle > 0) || !std::isfinite(angle)) {
            motion.is_held = true;
            continue;
        }
        motion.rotation = Eigen::AngleAxisd(angle, motion.angle / angle).toRotationMatrix();
        stretch_energy_ += 0.5 * modulus * motion.volume * std::pow(angle, 4);
    }
    for_phyxels(parallel, u.size(), [&](std::size_t i) {
        const Motion& motion = motion_[slot_of(phyxels.piece[i], motion_.size())];
        if (motion.is_held) return;
        const Vec3 arm = x[i] - motion.centre;
        const Vec3 strain = u[i] - motion.shift - motion.angle.cross(arm);
        u[i] = motion.shift + motion.rotation * (arm + strain) - arm;
    });
}

Vec3 FiniteRotations::centripetal(std::int32_t piece, const Vec3& x) const {
    const Motion& motion = motion_[slot_of(piece, motion_.size())];
    if (motion.is_held) return Vec3::Zero();
    return motion.angle.cross(motion.angle.cross(x - motion.centre));
}

void FiniteRotations::keep_strain(const Phyxels& phyxels, int piece_count, std::span<const std::uint8_t> held,
                                  std::span<const Vec3> x, std::span<Vec3> u, const Parallel& parallel) {
    motion_.assign(static_cast<std::size_t>(piece_count) + 1, Motion{});
    find_motions(phyxels, held, x, u);
    for (Motion& motion : motion_) motion.inertia.setZero();
    for (std::size_t i = 0; i < u.size(); ++i) {
        Motion& motion = motion_[slot_of(phyxels.piece[i], motion_.size())];
        if (motion.is_held) continue;
        const Vec3 arm = x[i] - motion.centre;
        motion.inertia += phyxels.mass[i] * (arm + u[i] - motion.shift) * arm.transpose();
    }
    for (Motion& motion : motion_)
        if (!motion.is_held) motion.rotation = rotation_of(motion.inertia);
    for_phyxels(parallel, u.size(), [&](std::size_t i) {
        const Motion& motion = motion_[slot_of(phyxels.piece[i], motion_.size())];
        if (motion.is_held) return;
        const Vec3 arm = x[i] - motion.centre;
        u[i] += arm - motion.shift - motion.rotation * arm;
    });
}

void FiniteRotations::straighten(Phyxels& phyxels, int piece_count, std::span<const std::uint8_t> skip,
                                 std::span<const Vec3> strain, double dt, const Parallel& parallel) {
    motion_.assign(static_cast<std::size_t>(piece_count) + 1, Motion{});
    find_motions(phyxels, skip, phyxels.position, phyxels.velocity);
    for (Motion& motion : motion_)
        if (!motion.is_held) motion.angle = angular_velocity(motion.inertia, motion.angle);
    for_phyxels(parallel, phyxels.size(), [&](std::size_t i) {
        const Motion& motion = motion_[slot_of(phyxels.piece[i], motion_.size())];
        if (motion.is_held) return;
        phyxels.velocity[i] =
            motion.shift + motion.angle.cross(phyxels.position[i] - motion.centre) + strain[i] / dt;
    });
}

}  // namespace splitcubes::meshless
