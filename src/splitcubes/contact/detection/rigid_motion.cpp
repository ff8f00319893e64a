#include <splitcubes/contact/detection/rigid_motion.h>
#include <splitcubes/math/cross_matrix.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/splitting/pieces.h>

namespace splitcubes::body {

Mat3 inverse_of_inertia(const Mat3& inertia) {
    Mat3 inverse;
    for (int axis = 0; axis < 3; ++axis)
        inverse.col(axis) = meshless::angular_velocity(inertia, Vec3::Unit(axis));
    return 0.5 * (inverse + inverse.transpose());
}

Mat3 mobility_at(double inverse_mass, const Mat3& inverse_inertia, const Vec3& arm) {
    const Mat3 cross = cross_matrix(arm);
    return inverse_mass * Mat3::Identity() - cross * inverse_inertia * cross;
}

std::vector<std::uint8_t> held_pieces(const BodyView& body) {
    std::vector<std::uint8_t> held(body.pieces.count(), 0);
    for (std::size_t i = 0; i < body.phyxels.held.size(); ++i)
        if (body.phyxels.held[i] != 0) held[static_cast<std::size_t>(body.phyxels.piece[i])] = 1;
    return held;
}

}  // namespace splitcubes::body
