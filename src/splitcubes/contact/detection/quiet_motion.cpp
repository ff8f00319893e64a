#include <splitcubes/contact/detection/quiet_motion.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/math/decompose.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/splitting/pieces.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace splitcubes::body {

Vec3 drift_of(const meshless::Phyxels& phyxels, std::size_t i, double dt, const Vec3& gravity) {
    const Vec3 fall = dt * gravity;
    const bool is_known = phyxels.history_step == dt && phyxels.restart_history[i] == 0;
    Vec3 change = is_known ? Vec3(phyxels.velocity[i] - phyxels.previous_velocity[i]) : fall;
    // Limited because a vibrating phyxel's last acceleration predicts nothing.
    const double square = change.squaredNorm(), max_square = fall.squaredNorm();
    if (!(square <= max_square)) change *= std::sqrt(max_square / square);
    return dt * change;
}

void QuietMotion::remember(std::span<const BodyView> bodies) {
    pieces_.clear();
    first_.clear();
    turns_ = false;
    position_.resize(bodies.size());
    deformation_.resize(bodies.size());
    drift_.resize(bodies.size());
    std::size_t count = 0;
    for (const BodyView& body : bodies) {
        first_.push_back(count);
        if (!body.is_lattice_driven) count += body.pieces.count();
        if (count > tuning::quiet::max_pieces || !body.phyxels.rigid.bodies.empty()) return forget();
    }
    pieces_.resize(count);
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (bodies[b].is_lattice_driven) continue;
        const meshless::Phyxels& phyxels = bodies[b].phyxels;
        position_[b].assign(phyxels.position.begin(), phyxels.position.end());
        deformation_[b].assign(phyxels.deformation.begin(), phyxels.deformation.end());
        drift_[b].resize(phyxels.size());
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            const std::size_t k = first_[b] + static_cast<std::size_t>(phyxels.piece[i]);
            if (phyxels.piece[i] < 0 || k >= count) return forget();
            pieces_[k].spacing = bodies[b].spacing;
            pieces_[k].centre_before += phyxels.position[i];
            ++pieces_[k].count;
        }
    }
    for (Piece& piece : pieces_) {
        if (piece.count == 0) return forget();
        piece.centre_before /= static_cast<double>(piece.count);
    }
}

bool QuietMotion::holds(std::span<const BodyView> bodies, const Step& step) {
    if (!remembers()) return false;
    // Most bodies do not turn, and their motion is cheaper to find.
    for (int k = 0; k < 2; ++k) {
        if (measure(bodies, step) && are_apart() && is_rigid(bodies, step)) return true;
        if (turns_) break;
        turns_ = true;
    }
    return false;
}

// Finds the rigid motions. Returns false if the bodies are not those that were remembered.
bool QuietMotion::measure(std::span<const BodyView> bodies, const Step& step) {
    if (bodies.size() != first_.size()) return false;
    for (Piece& piece : pieces_) {
        piece.centre = piece.velocity = piece.drift = piece.twist = Vec3::Zero();
        piece.covariance = piece.inertia = Mat3::Zero();
        piece.box = {};
    }
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (bodies[b].is_lattice_driven) continue;
        const meshless::Phyxels& phyxels = bodies[b].phyxels;
        if (phyxels.size() != position_[b].size() || !phyxels.rigid.bodies.empty()) return false;
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            Piece& piece = pieces_[first_[b] + static_cast<std::size_t>(phyxels.piece[i])];
            const Vec3 arm = phyxels.position[i] - piece.centre_before;
            const Vec3& velocity = phyxels.velocity[i];
            drift_[b][i] = drift_of(phyxels, i, step.dt, step.gravity);
            piece.centre += arm;
            piece.velocity += velocity;
            piece.drift += drift_[b][i];
            if (pieces_.size() > 1) {
                piece.box.add(phyxels.position[i]);
                piece.box.add(phyxels.position[i] + 2 * (step.dt * velocity + drift_[b][i]));
            }
            if (!turns_) continue;
            piece.covariance += arm * (position_[b][i] - piece.centre_before).transpose();
            piece.inertia += arm * arm.transpose();
            piece.twist += arm.cross(velocity);
        }
    }
    for (Piece& piece : pieces_) {
        const auto count = static_cast<double>(piece.count);
        piece.centre /= count;
        piece.velocity /= count;
        piece.drift /= count;
        piece.rotation = Mat3::Identity();
        piece.angular_velocity = Vec3::Zero();
        if (!turns_) {
            piece.centre += piece.centre_before;
            continue;
        }
        // The remembered arms sum to zero.
        piece.rotation = rotation_of(piece.covariance);
        const Mat3 spread = piece.inertia - count * piece.centre * piece.centre.transpose();
        const Mat3 inertia = spread.trace() * Mat3::Identity() - spread;
        const Vec3 twist = piece.twist - count * piece.centre.cross(piece.velocity);
        piece.angular_velocity = inertia.ldlt().solve(twist);
        piece.centre += piece.centre_before;
        if (!piece.angular_velocity.allFinite()) piece.angular_velocity.setZero();
    }
    return true;
}

// Returns whether no two pieces can come near each other.
bool QuietMotion::are_apart() const {
    for (std::size_t a = 0; a < pieces_.size(); ++a)
        for (std::size_t b = 0; b < a; ++b) {
            const geometry::Box &one = pieces_[a].box, &other = pieces_[b].box;
            const double distance =
                std::max((one.min - other.max).maxCoeff(), (other.min - one.max).maxCoeff());
            if (!(distance > tuning::quiet::apart_share * std::max(pieces_[a].spacing, pieces_[b].spacing)))
                return false;
        }
    return true;
}

// Returns whether no surface can have turned much against its piece.
bool QuietMotion::keeps_normals(const meshless::Phyxels& phyxels, std::size_t body) const {
    constexpr double limit = tuning::quiet::max_deformation;
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const Piece& piece = pieces_[first_[body] + static_cast<std::size_t>(phyxels.piece[i])];
        const Mat3 change = phyxels.deformation[i] - piece.rotation * deformation_[body][i];
        if (!(change.squaredNorm() < limit * limit)) return false;
    }
    return true;
}

// Returns whether phyxels left the rigid motion of their pieces by less than is allowed.
bool QuietMotion::is_rigid(std::span<const BodyView> bodies, const Step& step) const {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (bodies[b].is_lattice_driven) continue;
        const meshless::Phyxels& phyxels = bodies[b].phyxels;
        const double spacing = bodies[b].spacing;
        const double strained = tuning::quiet::max_displacement_share * spacing,
                     moving = tuning::quiet::max_motion_share * spacing,
                     bent = tuning::quiet::bending_displacement_share * spacing;
        double largest = 0;
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            const Piece& piece = pieces_[first_[b] + static_cast<std::size_t>(phyxels.piece[i])];
            const Vec3 arm = phyxels.position[i] - piece.centre;
            const Vec3 off = arm - piece.rotation * (position_[b][i] - piece.centre_before);
            const Vec3 motion =
                step.dt * (phyxels.velocity[i] - piece.velocity - piece.angular_velocity.cross(arm)) +
                drift_[b][i] - piece.drift;
            if (!(off.squaredNorm() < strained * strained) || !(motion.squaredNorm() < moving * moving))
                return false;
            largest = std::max(largest, off.squaredNorm());
        }
        if (largest > bent * bent && !keeps_normals(phyxels, b)) return false;
    }
    for (const Piece& piece : pieces_)
        if (!(piece.angular_velocity.norm() * step.dt < tuning::quiet::max_rotation)) return false;
    return true;
}

}  // namespace splitcubes::body
