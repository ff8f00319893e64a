#include <splitcubes/contact/detection/piece_turns.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/splitting/pieces.h>

#include <cmath>

namespace splitcubes::body {

void PieceTurns::measure(std::span<const BodyView> bodies, double dt, const Parallel& parallel) {
    turns_.resize(bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const BodyView& body = bodies[b];
        meshless::momenta_of_pieces(body.phyxels, static_cast<int>(body.pieces.count()), momenta_, sums_,
                                    parallel);
        turns_[b].assign(momenta_.size(), {});
        for (std::size_t k = 0; k < momenta_.size(); ++k) {
            const meshless::Momenta& piece = momenta_[k];
            const Vec3 angle = dt * meshless::angular_velocity(piece.inertia, piece.angular_momentum);
            if (angle.allFinite()) turns_[b][k] = {piece.mass, angle};
        }
    }
}

PieceTurns::Turn PieceTurns::turn_of(const Piece& piece) const {
    const auto index = static_cast<std::size_t>(piece.piece);
    if (piece.body >= turns_.size() || piece.piece < 0 || index >= turns_[piece.body].size()) return {};
    return turns_[piece.body][index];
}

Vec3 PieceTurns::change(const Piece& one, const Piece& other, const Vec3& vector) const {
    const Turn a = turn_of(one), b = turn_of(other);
    const Vec3 angle = (a.mass * a.angle + b.mass * b.angle) / (a.mass + b.mass);
    const double size = angle.norm();
    if (!(size > 0) || !(size < tuning::turns::max_angle) || !vector.allFinite()) return Vec3::Zero();
    return Eigen::AngleAxisd(size, angle / size) * vector - vector;
}

}  // namespace splitcubes::body
