#include <splitcubes/dynamics/rigid_step.h>
#include <splitcubes/dynamics/tuning.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::meshless {

namespace {

// Contact of a point of a body with the tangent plane of an obstacle.
struct PlaneContact {
    Vec3 point;                            // m, world
    Vec3 arm;                              // m, from the centre
    Vec3 normal;                           // unit, world, out of the obstacle
    Vec3 surface_velocity = Vec3::Zero();  // m/s, of the obstacle at the point
    double friction_limit = 0;             // Coulomb coefficient
    double min_normal_velocity = 0;        // m/s, minimum normal velocity relative to the obstacle
    double effective_normal_mass = 0;      // kg
    double normal_impulse = 0;             // N s
    Vec3 friction = Vec3::Zero();          // N s
};

// An obstacle at its interpolated position within the step.
struct MovedObstacle {
    const Obstacle& obstacle;
    Isometry frame;   // world from own coordinates
    Isometry to_own;  // inverse of frame

    MovedObstacle(const Obstacle& o, double share) : obstacle(o) {
        frame = o.before;
        to_own = frame.inverse();
        if (share == 0 || o.before.isApprox(o.after, 0)) return;
        const Quat from(o.before.linear()), to(o.after.linear());
        frame.linear() = from.slerp(share, to).toRotationMatrix();
        frame.translation() = (1 - share) * o.before.translation() + share * o.after.translation();
        frame.makeAffine();
        to_own = frame.inverse();
    }
    // Returns distance (m, negative inside) and normal in the world.
    geometry::SignedDistance::Sample at(const Vec3& point) const {
        geometry::SignedDistance::Sample sample = obstacle.solid->at(to_own * point);
        sample.normal = frame.linear() * sample.normal;
        return sample;
    }
    // Returns the velocity of the obstacle's material at a point, m/s.
    Vec3 velocity(const Vec3& point, double dt) const {
        const Vec3 own = to_own * point;
        return (obstacle.after * own - obstacle.before * own) / dt;
    }
};

double effective_mass(const RigidPiece& body, const Mat3& inverse, const Vec3& arm, const Vec3& direction) {
    const Vec3 lever = arm.cross(direction);
    return 1 / (1 / body.mass + lever.dot(inverse * lever));
}

// Finds the contact points within reach of a substep. share: of the step at the start of the substep; h:
// substep, s.
std::vector<PlaneContact> find_contacts(const RigidPieces& rigid, const RigidPiece& body,
                                        const StepInput& input, double share, double h) {
    std::vector<PlaneContact> contacts;
    const Mat3 inverse = body.inverse_inertia();
    for (const Obstacle& obstacle : input.obstacles) {
        const MovedObstacle moved_obstacle(obstacle, share);
        for (const Vec3& point : rigid.points_of(body)) {
            PlaneContact contact;
            contact.point = body.world_point(point);
            contact.arm = contact.point - body.centre;
            const geometry::SignedDistance::Sample nearest = moved_obstacle.at(contact.point);
            contact.normal = nearest.normal;
            contact.surface_velocity = moved_obstacle.velocity(contact.point, input.dt);
            // Twice the motion bound: the piece's own motion in the substep, and as much again from other
            // contacts.
            const double speed = body.velocity().norm() +
                                 (inverse * body.angular_momentum).norm() * contact.arm.norm() +
                                 contact.surface_velocity.norm();
            if (!(nearest.distance <= 2 * h * speed)) continue;
            contact.friction_limit = obstacle.friction;
            contact.min_normal_velocity = -std::max(nearest.distance, 0.0) / h;
            contact.effective_normal_mass = effective_mass(body, inverse, contact.arm, contact.normal);
            contacts.push_back(contact);
        }
    }
    return contacts;
}

// One iteration over the contacts; returns the largest velocity change, m/s.
double iterate_impulses(std::vector<PlaneContact>& contacts, RigidPiece& body) {
    const Mat3 inverse = body.inverse_inertia();
    const auto velocity = [&](const PlaneContact& contact) {
        return Vec3(body.velocity() + (inverse * body.angular_momentum).cross(contact.arm) -
                    contact.surface_velocity);
    };
    double largest = 0;
    for (PlaneContact& contact : contacts) {
        const double approach = contact.min_normal_velocity - contact.normal.dot(velocity(contact));
        const double normal_impulse =
            std::max(0.0, contact.normal_impulse + contact.effective_normal_mass * approach);
        const double change = normal_impulse - contact.normal_impulse;
        contact.normal_impulse = normal_impulse;
        body.push(contact.point, change * contact.normal);
        largest = std::max(largest, std::abs(change) / contact.effective_normal_mass);
        if (normal_impulse == 0 && contact.friction.isZero(0)) continue;
        Vec3 sliding_velocity = velocity(contact);
        sliding_velocity -= contact.normal * contact.normal.dot(sliding_velocity);
        const double speed = sliding_velocity.norm();
        if (!(speed > 0)) continue;
        const double mass = effective_mass(body, inverse, contact.arm, sliding_velocity / speed);
        Vec3 friction = contact.friction - mass * sliding_velocity;
        const double limit = contact.friction_limit * normal_impulse;
        if (friction.norm() > limit) friction *= limit / friction.norm();
        const Vec3 push = friction - contact.friction;
        contact.friction = friction;
        body.push(contact.point, push);
        largest = std::max(largest, push.norm() / mass);
    }
    return largest;
}

// Applies the impulses of the obstacles. Returns whether any contact is active.
bool apply_obstacle_impulses(const RigidPieces& rigid, const StepInput& input, double share, double h,
                             RigidPiece& body) {
    std::vector<PlaneContact> contacts = find_contacts(rigid, body, input, share, h);
    if (contacts.empty()) return false;
    const double before = body.kinetic_energy();
    double surface_velocity = 0;
    for (const PlaneContact& contact : contacts)
        surface_velocity = std::max(surface_velocity, contact.surface_velocity.norm());
    const double tolerance = 1e-6 * (std::sqrt(2 * before / body.mass) + surface_velocity);
    for (int iteration = 0; iteration < tuning::rigid::max_impulse_iterations; ++iteration)
        if (iterate_impulses(contacts, body) <= tolerance) break;
    const bool touches = std::any_of(contacts.begin(), contacts.end(),
                                     [](const PlaneContact& c) { return c.normal_impulse > 0; });
    if (!touches) return false;
    if (surface_velocity > 0) return true;
    // Incomplete iterations must not add energy.
    const double after = body.kinetic_energy();
    if (after > before) {
        body.momentum *= std::sqrt(before / after);
        body.angular_momentum *= std::sqrt(before / after);
    }
    const double resting = tuning::rigid::resting_share * input.gravity.norm() * h;
    if (body.kinetic_energy() < 0.5 * body.mass * resting * resting) {
        body.momentum.setZero();
        body.angular_momentum.setZero();
    }
    return true;
}

// Returns the sample of the point that lies deepest in, or nearest to, an obstacle.
geometry::SignedDistance::Sample deepest(const RigidPieces& rigid, const MovedObstacle& moved_obstacle,
                                         const RigidPiece& body) {
    geometry::SignedDistance::Sample lowest;
    lowest.distance = std::numeric_limits<double>::infinity();
    for (const Vec3& point : rigid.points_of(body)) {
        const geometry::SignedDistance::Sample sample = moved_obstacle.at(body.world_point(point));
        if (sample.distance < lowest.distance) lowest = sample;
    }
    return lowest;
}

void move_freely(const Vec3& gravity, double damping_factor, double dt, RigidPiece& body) {
    const Vec3 before = body.velocity();
    body.momentum = damping_factor * (body.momentum + dt * body.mass * gravity);
    body.angular_momentum *= damping_factor;
    body.centre += 0.5 * dt * (before + body.velocity());
    turn_freely(body, dt);
}

void move_among_obstacles(const RigidPieces& rigid, const StepInput& input, double damping_factor,
                          RigidPiece& body) {
    std::vector<double> depth;  // per obstacle, m, <= 0
    for (const Obstacle& obstacle : input.obstacles)
        depth.push_back(std::min(deepest(rigid, MovedObstacle(obstacle, 0), body).distance, 0.0));
    const double angle = body.angular_velocity().norm() * input.dt;
    const int substeps = std::max(
        1, static_cast<int>(std::min<double>(std::ceil(angle / tuning::rigid::max_contact_substep_rotation),
                                             tuning::rigid::max_contact_substeps)));
    const double h = input.dt / substeps;
    const double substep_damping_factor = std::pow(damping_factor, 1.0 / substeps);
    for (int k = 0; k < substeps; ++k) {
        const Vec3 before = body.velocity();
        body.momentum = substep_damping_factor * (body.momentum + h * body.mass * input.gravity);
        body.angular_momentum *= substep_damping_factor;
        const bool touches =
            apply_obstacle_impulses(rigid, input, static_cast<double>(k) / substeps, h, body);
        body.touching = touches;
        body.centre += touches ? Vec3(h * body.velocity()) : Vec3(0.5 * h * (before + body.velocity()));
        turn_freely(body, h, tuning::rigid::max_rotation_substeps / substeps);
    }
    // Corrects the penetration gained since points move on arcs, and a share of the initial one.
    for (std::size_t k = 0; k < depth.size(); ++k) {
        const geometry::SignedDistance::Sample now =
            deepest(rigid, MovedObstacle(input.obstacles[k], 1), body);
        const double correction = (1 - tuning::rigid::penetration_correction_share) * depth[k] - now.distance;
        if (correction > 0) body.centre += correction * now.normal;
    }
}

void follow_motion(const Isometry& motion, double dt, RigidPiece& body) {
    const Vec3 centre = motion * body.centre;
    const Eigen::AngleAxisd rotation(motion.linear());
    body.momentum = body.mass * (centre - body.centre) / dt;
    body.rotation = Quat(Mat3(motion.linear() * body.rotation)).normalized().toRotationMatrix();
    body.angular_momentum = body.world_inertia() * (rotation.angle() / dt * rotation.axis());
    body.centre = centre;
}

}  // namespace

void step_rigid(Phyxels& phyxels, const StepInput& input, double mass_damping) {
    RigidPieces& rigid = phyxels.rigid;
    const double damping_factor = 1 / (1 + input.dt * mass_damping);
    for (std::size_t k = 0; k < rigid.bodies.size(); ++k) {
        RigidPiece& body = rigid.bodies[k];
        body.touching = 0;
        const auto hold =
            std::find_if(input.kinematic_rigid_pieces.begin(), input.kinematic_rigid_pieces.end(),
                         [&](const RigidKinematicTarget& h) { return h.body == k; });
        if (hold != input.kinematic_rigid_pieces.end())
            follow_motion(hold->motion, input.dt, body);
        else if (!input.obstacles.empty())
            move_among_obstacles(rigid, input, damping_factor, body);
        else
            move_freely(input.gravity, damping_factor, input.dt, body);
    }
}

}  // namespace splitcubes::meshless
