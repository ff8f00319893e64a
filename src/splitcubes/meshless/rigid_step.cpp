#include <splitcubes/meshless/rigid_step.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::meshless {

namespace {

// Angle that a substep of a piece on the ground turns by at most, rad.
constexpr double most_turn = 0.1;
constexpr int most_substeps = 256;
constexpr int most_rounds = 40;
// Share of the speed that gravity gives in a substep below which a touching piece rests.
constexpr double resting_share = 0.02;
// Share of a depth that a piece found below the ground is lifted by in a step.
constexpr double lift_share = 0.2;

// A point of a body that meets the plane within a substep.
struct Contact {
    Vec3 place;                    // m, world
    Vec3 arm;                      // m, from the centre
    double allowed = 0;            // m/s, normal velocity that it may have at least
    double normal_mass = 0;        // kg
    double pressure = 0;           // N s
    Vec3 friction = Vec3::Zero();  // N s
};

double gap_of(const GroundPlane& ground, const Vec3& place) {
    return ground.normal.dot(place) - ground.offset;
}

double effective_mass(const RigidPiece& body, const Mat3& inverse, const Vec3& arm, const Vec3& direction) {
    const Vec3 turn = arm.cross(direction);
    return 1 / (1 / body.mass + turn.dot(inverse * turn));
}

std::vector<Contact> find_contacts(const RigidPieces& rigid, const RigidPiece& body,
                                   const GroundPlane& ground, double h) {
    std::vector<Contact> contacts;
    const Mat3 inverse = body.inverse_inertia();
    for (const Vec3& point : rigid.points_of(body)) {
        Contact contact;
        contact.place = body.place_of(point);
        contact.arm = contact.place - body.centre;
        const double gap = gap_of(ground, contact.place);
        // As far as it can come down in the substep, and as far again for what others push.
        const double speed = body.velocity().norm() + (inverse * body.spin).norm() * contact.arm.norm();
        if (gap > 2 * h * speed) continue;
        contact.allowed = -std::max(gap, 0.0) / h;
        contact.normal_mass = effective_mass(body, inverse, contact.arm, ground.normal);
        contacts.push_back(contact);
    }
    return contacts;
}

// One round over the contacts; returns the largest change of velocity that it made, m/s.
double push_apart(std::vector<Contact>& contacts, const GroundPlane& ground, RigidPiece& body) {
    const Mat3 inverse = body.inverse_inertia();
    const auto velocity = [&](const Contact& contact) {
        return Vec3(body.velocity() + (inverse * body.spin).cross(contact.arm));
    };
    double largest = 0;
    for (Contact& contact : contacts) {
        const double approach = contact.allowed - ground.normal.dot(velocity(contact));
        const double pressure = std::max(0.0, contact.pressure + contact.normal_mass * approach);
        const double change = pressure - contact.pressure;
        contact.pressure = pressure;
        body.push(contact.place, change * ground.normal);
        largest = std::max(largest, std::abs(change) / contact.normal_mass);
        if (pressure == 0 && contact.friction.isZero(0)) continue;
        Vec3 slip = velocity(contact);
        slip -= ground.normal * ground.normal.dot(slip);
        const double speed = slip.norm();
        if (!(speed > 0)) continue;
        const double mass = effective_mass(body, inverse, contact.arm, slip / speed);
        Vec3 friction = contact.friction - mass * slip;
        const double limit = ground.friction * pressure;
        if (friction.norm() > limit) friction *= limit / friction.norm();
        const Vec3 push = friction - contact.friction;
        contact.friction = friction;
        body.push(contact.place, push);
        largest = std::max(largest, push.norm() / mass);
    }
    return largest;
}

// Takes from the momenta what the ground stops. Returns whether it stops anything.
bool meet_ground(const RigidPieces& rigid, const GroundPlane& ground, double gravity, double h,
                 RigidPiece& body) {
    std::vector<Contact> contacts = find_contacts(rigid, body, ground, h);
    if (contacts.empty()) return false;
    const double before = body.kinetic_energy();
    const double enough = 1e-6 * std::sqrt(2 * before / body.mass);
    for (int round = 0; round < most_rounds; ++round)
        if (push_apart(contacts, ground, body) <= enough) break;
    const bool touches =
        std::any_of(contacts.begin(), contacts.end(), [](const Contact& c) { return c.pressure > 0; });
    if (!touches) return false;
    // Rounds that were not enough must not leave more than there was.
    const double after = body.kinetic_energy();
    if (after > before) {
        body.momentum *= std::sqrt(before / after);
        body.spin *= std::sqrt(before / after);
    }
    const double resting = resting_share * gravity * h;
    if (body.kinetic_energy() < 0.5 * body.mass * resting * resting) {
        body.momentum.setZero();
        body.spin.setZero();
    }
    return true;
}

double lowest_gap(const RigidPieces& rigid, const GroundPlane& ground, const RigidPiece& body) {
    double lowest = std::numeric_limits<double>::infinity();
    for (const Vec3& point : rigid.points_of(body))
        lowest = std::min(lowest, gap_of(ground, body.place_of(point)));
    return lowest;
}

void fall(const Vec3& gravity, double kept, double dt, RigidPiece& body) {
    const Vec3 before = body.velocity();
    body.momentum = kept * (body.momentum + dt * body.mass * gravity);
    body.spin *= kept;
    body.centre += 0.5 * dt * (before + body.velocity());
    turn_freely(body, dt);
}

void fall_on_ground(const RigidPieces& rigid, const StepInput& input, double kept, RigidPiece& body) {
    const GroundPlane& ground = *input.ground;
    const double depth = std::min(lowest_gap(rigid, ground, body), 0.0);
    const double turn = body.angular_velocity().norm() * input.dt;
    const int substeps =
        std::max(1, static_cast<int>(std::min<double>(std::ceil(turn / most_turn), most_substeps)));
    const double h = input.dt / substeps;
    const double kept_each = std::pow(kept, 1.0 / substeps);
    for (int k = 0; k < substeps; ++k) {
        const Vec3 before = body.velocity();
        body.momentum = kept_each * (body.momentum + h * body.mass * input.gravity);
        body.spin *= kept_each;
        const bool touches = meet_ground(rigid, ground, input.gravity.norm(), h, body);
        body.touching = touches;
        body.centre += touches ? Vec3(h * body.velocity()) : Vec3(0.5 * h * (before + body.velocity()));
        turn_freely(body, h);
    }
    // What it sank, since places go round on arcs, and a share of what it was below before.
    const double sunk = (1 - lift_share) * depth - lowest_gap(rigid, ground, body);
    if (sunk > 0) body.centre += sunk * ground.normal;
}

void follow(const Isometry& motion, double dt, RigidPiece& body) {
    const Vec3 centre = motion * body.centre;
    const Eigen::AngleAxisd turn(motion.linear());
    body.momentum = body.mass * (centre - body.centre) / dt;
    body.rotation = Quat(Mat3(motion.linear() * body.rotation)).normalized().toRotationMatrix();
    body.spin = body.rotation * body.inertia * body.rotation.transpose() * (turn.angle() / dt * turn.axis());
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
        else if (input.ground)
            fall_on_ground(rigid, input, kept, body);
        else
            fall(input.gravity, kept, input.dt, body);
    }
}

}  // namespace splitcubes::meshless
