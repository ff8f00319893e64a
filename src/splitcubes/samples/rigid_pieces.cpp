#include <splitcubes/math/cross_matrix.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/samples/rigid_pieces.h>
#include <splitcubes/samples/tuning.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace splitcubes::meshless {

namespace {

// Cayley's map: returns the rotation (I - a/2)^-1 (I + a/2) for the cross matrix a of v.
Mat3 cayley(const Vec3& v) {
    const Mat3 a = cross_matrix(v);
    return Mat3::Identity() + (a + 0.5 * a * a) / (1 + 0.25 * v.squaredNorm());
}

Mat3 inertia_of(const Mat3& second_moment) {
    return second_moment.trace() * Mat3::Identity() - second_moment;
}

// Rotates about the axis of the angular momentum at the current rate about it. The body-frame angular
// momentum does not change, so angular momentum and energy are conserved for any angle.
void precess(RigidPiece& body, double dt) {
    const double angular_momentum = body.angular_momentum.norm();
    if (!(angular_momentum > 0) || !std::isfinite(angular_momentum)) return;
    const Vec3 axis = body.angular_momentum / angular_momentum;
    const double angle = std::remainder(body.angular_velocity().dot(axis) * dt, 2 * std::numbers::pi);
    if (!std::isfinite(angle)) return;
    body.rotation = Quat(Mat3(Eigen::AngleAxisd(angle, axis).toRotationMatrix() * body.rotation))
                        .normalized()
                        .toRotationMatrix();
}

}  // namespace

Mat3 RigidPiece::inverse_inertia() const {
    return rotation * inertia.inverse() * rotation.transpose();
}

double RigidPiece::kinetic_energy() const {
    return 0.5 * (momentum.squaredNorm() / mass + angular_momentum.dot(angular_velocity()));
}

void RigidPieces::put(RigidPiece body, std::span<const Vec3> own_points) {
    assert(body.piece >= 0);
    const auto piece = static_cast<std::size_t>(body.piece);
    if (of_piece.size() <= piece) of_piece.resize(piece + 1, -1);
    const bool is_new = of_piece[piece] < 0;
    if (is_new) {
        of_piece[piece] = static_cast<std::int32_t>(bodies.size());
        bodies.emplace_back();
    }
    RigidPiece& place = bodies[static_cast<std::size_t>(of_piece[piece])];
    const bool fits = own_points.size() <= place.point_count;
    body.first_point = fits ? place.first_point : static_cast<std::uint32_t>(points.size());
    body.point_count = static_cast<std::uint32_t>(own_points.size());
    if (!fits) points.resize(points.size() + own_points.size());
    std::copy(own_points.begin(), own_points.end(), points.begin() + body.first_point);
    place = body;
}

void weigh(const RigidCubes& cubes, RigidPiece& body) {
    body.mass = 0;
    Vec3 moment = Vec3::Zero();
    for (std::size_t b = 0; b < cubes.mass.size(); ++b) {
        body.mass += cubes.mass[b];
        moment += cubes.mass[b] * cubes.rest_position[b];
    }
    assert(body.mass > 0);
    body.rest_centre = moment / body.mass;
    Mat3 second = body.mass * cubes.edge * cubes.edge / 12 * Mat3::Identity();
    for (std::size_t b = 0; b < cubes.mass.size(); ++b) {
        const Vec3 arm = cubes.rest_position[b] - body.rest_centre;
        second += cubes.mass[b] * arm * arm.transpose();
    }
    body.inertia = inertia_of(body.shape * second * body.shape.transpose());
}

void turn_freely(RigidPiece& body, double dt, int max_substeps) {
    const Mat3 inverse = body.inertia.inverse();
    const double max_angular_speed =
        body.angular_momentum.norm() * inverse.norm();  // rad/s, upper bound of its angular speed
    const double needed_substeps = std::ceil(max_angular_speed * dt / tuning::rigid::max_substep_rotation);
    if (!(needed_substeps <= std::max(1, max_substeps))) {
        precess(body, dt);
        return;
    }
    const int substeps = std::max(1, static_cast<int>(needed_substeps));
    const double h = dt / substeps;
    for (int k = 0; k < substeps; ++k) {
        const Vec3 before = body.rotation.transpose() * body.angular_momentum;
        Vec3 rotation_vector = h * (inverse * before);  // rad, own frame
        for (int iteration = 0; iteration < tuning::rigid::max_midpoint_iterations; ++iteration) {
            const Vec3 after = cayley(-rotation_vector) * before;
            const Vec3 next = h * (inverse * (0.5 * (before + after)));
            const double change = (next - rotation_vector).norm();
            rotation_vector = next;
            if (change <= 1e-16 * rotation_vector.norm()) break;
        }
        body.rotation = body.rotation * cayley(rotation_vector);
    }
    body.rotation = Quat(body.rotation).normalized().toRotationMatrix();
}

Momenta momenta_of(const RigidPiece& body) {
    Momenta sum;
    sum.mass = body.mass;
    sum.centre = body.centre;
    sum.linear = body.momentum;
    sum.angular_momentum = body.angular_momentum;
    sum.inertia = body.world_inertia();
    return sum;
}

void write_phyxels(Phyxels& phyxels) {
    const RigidPieces& rigid = phyxels.rigid;
    if (rigid.empty()) return;
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const std::int32_t index = rigid.index(phyxels.piece[i]);
        if (index < 0) continue;
        const RigidPiece& body = rigid.bodies[static_cast<std::size_t>(index)];
        phyxels.position[i] = body.world_point_of_rest(phyxels.rest_position[i]);
        phyxels.velocity[i] = body.velocity_at(phyxels.position[i]);
        phyxels.deformation[i] = body.rotation * body.shape;
        phyxels.rotation[i] = body.rotation;
        phyxels.touching[i] = body.touching;
        phyxels.restart_history[i] = 1;
    }
}

}  // namespace splitcubes::meshless
