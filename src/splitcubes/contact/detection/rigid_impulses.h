// Impulses between rigid bodies.
#pragma once

#include <splitcubes/math/types.h>

#include <cstdint>
#include <vector>

namespace splitcubes::body {

/// Finds inelastic impulses with Coulomb friction at the contacts of rigid bodies by projected Gauss-Seidel
/// on the velocities (Erleben 2007). Runs on one thread.
class RigidImpulses {
  public:
    struct Mover {
        double mobility = 0;                   // 1/kg, inverse mass; 0: held
        Mat3 inverse_inertia = Mat3::Zero();   // 1/(kg m^2), world
        Vec3 velocity = Vec3::Zero();          // m/s, of the centre
        Vec3 angular_velocity = Vec3::Zero();  // rad/s

        Vec3 velocity_at(const Vec3& arm) const { return velocity + angular_velocity.cross(arm); }
        void push(const Vec3& arm, const Vec3& impulse) {
            velocity += mobility * impulse;
            angular_velocity += inverse_inertia * arm.cross(impulse);
        }
    };
    struct Contact {
        std::uint32_t upper = 0, lower = 0;                 // indices of movers
        Vec3 normal = Vec3::UnitZ();                        // from lower to upper
        Vec3 arm = Vec3::Zero(), lower_arm = Vec3::Zero();  // m, lever arms of the application point
        Vec3 lower_velocity = Vec3::Zero();  // m/s, of the lower side beyond the motion of its mover
        double min_normal_velocity = 0;      // m/s, minimum relative normal velocity after the impulses
        double friction = 0;                 // Coulomb coefficient
    };

    /// Forgets all contacts and sets the movers.
    void reset(std::vector<Mover> movers);
    void add(const Contact& contact);
    /// Iterates over the contacts. first_piece, end_piece: range of the movers that stand for elastic pieces.
    void solve(std::uint32_t first_piece, std::uint32_t end_piece);

    const std::vector<Mover>& movers() const { return movers_; }
    /// Returns the impulse on the upper mover of a contact, N s.
    Vec3 impulse(std::size_t contact) const;
    /// Returns the number of contacts with an impulse.
    std::size_t active() const;

  private:
    /// Tells when a contact without impulse must be solved again. Most contacts have none.
    struct Watch {
        std::uint32_t upper = 0, lower = 0;
        double until = 0;  // m/s, sum of the changes of both movers below which it has none
    };
    /// Bounds of how much a unit impulse changes the velocity at any contact of each mover, 1/kg.
    struct Gain {
        double upper = 0, lower = 0;
    };
    /// A row is what the normal impulse of a contact takes.
    struct Row {
        Vec3 normal = Vec3::UnitZ();
        Vec3 torque = Vec3::Zero(), lower_torque = Vec3::Zero();  // m, of a unit impulse on each side
        double min_velocity = 0;   // m/s, minimum normal velocity of the movers after the impulses
        double mass = 0;           // kg, effective
        double impulse = 0;        // N s
        std::int32_t active = -1;  // index of its active row; -1: it never had an impulse
    };
    /// An active row is what a contact needs in addition once it has an impulse.
    struct ActiveRow {
        Vec3 turn = Vec3::Zero(), lower_turn = Vec3::Zero();  // 1/(kg m), angular velocity of a unit impulse
        Vec3 arm = Vec3::Zero(), lower_arm = Vec3::Zero();    // m
        Vec3 velocity = Vec3::Zero();  // m/s, of the lower side beyond the motion of its mover
        double friction = 0;           // Coulomb coefficient
        double tangential_mass = 0;    // kg
        Gain gain, friction_gain;
        Vec3 impulse = Vec3::Zero();  // N s, friction
    };

    Mat3 mobility_of(const Contact& contact) const;
    double solve(std::size_t k);
    ActiveRow& activate(std::size_t k);
    double apply_friction(const Watch& watch, const Row& row, ActiveRow& active);
    void add_change(const Watch& watch, double impulse, const Gain& gain);

    std::vector<Mover> movers_;
    std::vector<double> reach_;    // m, per mover: longest arm of its contacts
    std::vector<double> changes_;  // m/s, per mover: at most how much the velocity at any of them changed
    std::vector<Watch> watches_;   // per row
    std::vector<Row> rows_;
    std::vector<ActiveRow> active_rows_;
    std::vector<Contact> contacts_;  // per row
    double fastest_ = 0;             // m/s, largest relative velocity before the impulses
};

}  // namespace splitcubes::body
