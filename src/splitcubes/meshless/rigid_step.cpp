#include <splitcubes/meshless/rigid_step.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::meshless {

namespace {

// Angle that a substep of a piece among obstacles turns by at most, rad.
constexpr double most_substep_turn = 0.1;
constexpr int most_sliding_substeps = 256;
// Substeps of its turning, in all of these together.
constexpr int most_turning_substeps = 4096;
constexpr int max_impulse_iterations = 40;
// Share of the speed that gravity gives in a substep below which a touching piece rests.
constexpr double resting_share = 0.02;
// Share of a depth that a piece found within an obstacle is lifted by in a step.
constexpr double depenetration_share = 0.2;

// A point of a body that meets an obstacle within a substep.
struct PlaneContact {
    Vec3 point;                            // m, world
    Vec3 arm;                              // m, from the centre
    Vec3 normal;                           // unit, world, out of the obstacle
    Vec3 surface_velocity = Vec3::Zero();  // m/s, of the obstacle there
    double friction_limit = 0;             // Coulomb coefficient
    double min_normal_velocity = 0;    // m/s, normal velocity against the obstacle that it may have at least
    double effective_normal_mass = 0;  // kg
    double normal_impulse = 0;         // N s
    Vec3 friction = Vec3::Zero();      // N s
};

// An obstacle at a share of the step.
struct Placed {
    const Obstacle& obstacle;
    Isometry frame;   // world from own
    Isometry to_own;  // its inverse

    Placed(const Obstacle& o, double share) : obstacle(o) {
        frame = o.before;
        to_own = frame.inverse();
        if (share == 0 || o.before.isApprox(o.after, 0)) return;
        const Quat from(o.before.linear()), to(o.after.linear());
        frame.linear() = from.slerp(share, to).toRotationMatrix();
        frame.translation() = (1 - share) * o.before.translation() + share * o.after.translation();
        frame.makeAffine();
        to_own = frame.inverse();
    }
    // Distance (m, negative inside) and normal in the world.
    geometry::SignedDistance::Sample at(const Vec3& point) const {
        geometry::SignedDistance::Sample sample = obstacle.solid->at(to_own * point);
        sample.normal = frame.linear() * sample.normal;
        return sample;
    }
    // m/s, of the obstacle's matter at a place.
    Vec3 velocity(const Vec3& point, double dt) const {
        const Vec3 own = to_own * point;
        return (obstacle.after * own - obstacle.before * own) / dt;
    }
};

double effective_mass(const RigidPiece& body, const Mat3& inverse, const Vec3& arm, const Vec3& direction) {
    const Vec3 turn = arm.cross(direction);
    return 1 / (1 / body.mass + turn.dot(inverse * turn));
}

// share: of the step, where the substep of h seconds begins.
std::vector<PlaneContact> find_contacts(const RigidPieces& rigid, const RigidPiece& body,
                                        const StepInput& input, double share, double h) {
    std::vector<PlaneContact> contacts;
    const Mat3 inverse = body.inverse_inertia();
    for (const Obstacle& obstacle : input.obstacles) {
        const Placed placed(obstacle, share);
        for (const Vec3& point : rigid.points_of(body)) {
            PlaneContact contact;
            contact.point = body.world_point(point);
            contact.arm = contact.point - body.centre;
            const geometry::SignedDistance::Sample nearest = placed.at(contact.point);
            contact.normal = nearest.normal;
            contact.surface_velocity = placed.velocity(contact.point, input.dt);
            // As far as it can come down in the substep, and as far again for what others push.
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

// One round over the contacts; returns the largest change of velocity that it made, m/s.
double push_apart(std::vector<PlaneContact>& contacts, RigidPiece& body) {
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

// Takes from the momenta what obstacles stop. Returns whether they stop anything.
bool meet_obstacles(const RigidPieces& rigid, const StepInput& input, double share, double h,
                    RigidPiece& body) {
    std::vector<PlaneContact> contacts = find_contacts(rigid, body, input, share, h);
    if (contacts.empty()) return false;
    const double before = body.kinetic_energy();
    double surface_velocity = 0;
    for (const PlaneContact& contact : contacts)
        surface_velocity = std::max(surface_velocity, contact.surface_velocity.norm());
    const double enough = 1e-6 * (std::sqrt(2 * before / body.mass) + surface_velocity);
    for (int iteration = 0; iteration < max_impulse_iterations; ++iteration)
        if (push_apart(contacts, body) <= enough) break;
    const bool touches = std::any_of(contacts.begin(), contacts.end(),
                                     [](const PlaneContact& c) { return c.normal_impulse > 0; });
    if (!touches) return false;
    if (surface_velocity > 0) return true;
    // Rounds that were not enough must not leave more than there was.
    const double after = body.kinetic_energy();
    if (after > before) {
        body.momentum *= std::sqrt(before / after);
        body.angular_momentum *= std::sqrt(before / after);
    }
    const double resting = resting_share * input.gravity.norm() * h;
    if (body.kinetic_energy() < 0.5 * body.mass * resting * resting) {
        body.momentum.setZero();
        body.angular_momentum.setZero();
    }
    return true;
}

// Of the point that is deepest in, or nearest to, an obstacle.
geometry::SignedDistance::Sample deepest(const RigidPieces& rigid, const Placed& placed,
                                         const RigidPiece& body) {
    geometry::SignedDistance::Sample lowest;
    lowest.distance = std::numeric_limits<double>::infinity();
    for (const Vec3& point : rigid.points_of(body)) {
        const geometry::SignedDistance::Sample sample = placed.at(body.world_point(point));
        if (sample.distance < lowest.distance) lowest = sample;
    }
    return lowest;
}

void fall(const Vec3& gravity, double kept, double dt, RigidPiece& body) {
    const Vec3 before = body.velocity();
    body.momentum = kept * (body.momentum + dt * body.mass * gravity);
    body.angular_momentum *= kept;
    body.centre += 0.5 * dt * (before + body.velocity());
    turn_freely(body, dt);
}

void fall_on_obstacles(const RigidPieces& rigid, const StepInput& input, double kept, RigidPiece& body) {
    std::vector<double> depth;  // per obstacle, m, <= 0
    for (const Obstacle& obstacle : input.obstacles)
        depth.push_back(std::min(deepest(rigid, Placed(obstacle, 0), body).distance, 0.0));
    const double turn = body.angular_velocity().norm() * input.dt;
    const int substeps = std::max(
        1, static_cast<int>(std::min<double>(std::ceil(turn / most_substep_turn), most_sliding_substeps)));
    const double h = input.dt / substeps;
    const double kept_each = std::pow(kept, 1.0 / substeps);
    for (int k = 0; k < substeps; ++k) {
        const Vec3 before = body.velocity();
        body.momentum = kept_each * (body.momentum + h * body.mass * input.gravity);
        body.angular_momentum *= kept_each;
        const bool touches = meet_obstacles(rigid, input, static_cast<double>(k) / substeps, h, body);
        body.touching = touches;
        body.centre += touches ? Vec3(h * body.velocity()) : Vec3(0.5 * h * (before + body.velocity()));
        turn_freely(body, h, most_turning_substeps / substeps);
    }
    // What it sank, since places go round on arcs, and a share of how deep it was before.
    for (std::size_t k = 0; k < depth.size(); ++k) {
        const geometry::SignedDistance::Sample now = deepest(rigid, Placed(input.obstacles[k], 1), body);
        const double sunk = (1 - depenetration_share) * depth[k] - now.distance;
        if (sunk > 0) body.centre += sunk * now.normal;
    }
}

void follow(const Isometry& motion, double dt, RigidPiece& body) {
    const Vec3 centre = motion * body.centre;
    const Eigen::AngleAxisd turn(motion.linear());
    body.momentum = body.mass * (centre - body.centre) / dt;
    body.rotation = Quat(Mat3(motion.linear() * body.rotation)).normalized().toRotationMatrix();
    body.angular_momentum =
        body.rotation * body.inertia * body.rotation.transpose() * (turn.angle() / dt * turn.axis());
    body.centre = centre;
}

}  // namespace

void step_rigid(Phyxels& phyxels, const StepInput& input, double mass_damping) {
    RigidPieces& rigid = phyxels.rigid;
    const double kept = 1 / (1 + input.dt * mass_damping);
    for (std::size_t k = 0; k < rigid.bodies.size(); ++k) {
        RigidPiece& body = rigid.bodies[k];
        body.touching = 0;
        const auto hold = std::find_if(input.rigid_holds.begin(), input.rigid_holds.end(),
                                       [&](const RigidHold& h) { return h.body == k; });
        if (hold != input.rigid_holds.end())
            follow(hold->motion, input.dt, body);
        else if (!input.obstacles.empty())
            fall_on_obstacles(rigid, input, kept, body);
        else
            fall(input.gravity, kept, input.dt, body);
    }
}

}  // namespace splitcubes::meshless
