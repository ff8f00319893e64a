// Contacts as impulses on the phyxels, for explicit steps.
#pragma once

#include <splitcubes/contact/response/contact.h>
#include <splitcubes/contact/response/contact_forces.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Contacts as impulses on the velocities of a substep (Moreau 1999), found by projected Gauss-Seidel over
/// all contacts, started from those of the last substep. They push only, and friction is at most its
/// coefficient times the normal impulse of the same substep. A contact that sticks does not move at all.
///
/// A contact yields like a spring and a damper in parallel, up to a small overlap that is never exceeded.
/// Both are taken at the end of the substep, so that they take energy and give none, however long it is.
/// Without the damper an undamped body would vibrate on its support for ever: it slides whenever it swings
/// up, although it would stick at rest.
///
/// The overlap is measured from the rest gap: zero, or the overlap at which a contact was first found, which
/// is lifted by a little in each step: freely on colliders; between bodies by what the impulses of the last
/// step took. On colliders the rest gap follows what is found deeper than it was left
/// (CachedContact::rest_at).
class ContactImpulses {
  public:
    struct Part {
        std::span<const Vec3> start;             // m, positions before the step
        std::span<const double> effective_mass;  // kg
        std::span<const double> stiffness;       // N/m, diagonal of the stiffness matrix
        std::span<const std::uint8_t> fixed;     // per phyxel; 1: motion is prescribed
    };
    void begin(const ContactInput& input, std::span<const Part> parts, double dt);
    /// Returns the phyxels of a part that contacts may act on, each once.
    std::span<const std::uint32_t> touched(std::uint32_t part) const { return touched_[part]; }
    /// Adds the impulses of `duration` seconds to the velocities with which the phyxels will move from their
    /// positions for h seconds. done: share of the step that is over before.
    void push(ConstField position, Field velocity, double h, double duration, double done);
    /// Adds the impulses of `duration` seconds to the velocities at the end of the step.
    void stop(ConstField position, Field velocity, double duration);
    /// Writes the cached contacts (mean force of the step) and marks the phyxels that touched during the
    /// step.
    void finish(std::span<const std::span<std::uint8_t>> touching);
    /// Returns the energy that the springs hold at the end of the step, J. Must be called after stop.
    double energy() const;
    /// Adds the forces of the attachment springs at the given positions, N.
    void add_handle_springs(ConstField position, Field force);
    /// Returns the power of these forces on what is not fixed, W, by the forces of the last call.
    double handle_power(Field velocity) const;

  private:
    struct Incidence {
        std::uint32_t part = 0, phyxel = 0;
        double weight = 0;    // negative for the lower side
        double mobility = 0;  // 1/kg, weight over mass; 0 if the phyxel is held
    };
    struct ImpulseRow {
        std::uint32_t contact = 0;
        std::uint32_t first = 0, end = 0;      // of its incidences
        Vec3 normal = Vec3::UnitZ();           // of the contact
        Vec3 start = Vec3::Zero();             // m, upper minus lower point before the step
        Vec3 surface_velocity = Vec3::Zero();  // m/s, of a collider
        double friction = 0;                   // of the contact
        double mass = 0;                       // kg, inverse mobility of the relative motion
        double stiffness = 0, damping = 0;     // N/m, N s/m
        double rest_gap = 0, lift = 0;         // m; m, by which the rest gap rises within the step
        double gap = 0, drift = 0;             // m, at the end of the step; CachedContact::drift
        double overlap() const { return std::max(0.0, rest_gap - gap); }
        double lifted_gap = 0;  // m, the rest gap in the last substep
        // Of a substep: the impulse of the spring without motion, N s; that of spring and damper per speed,
        // kg; the speeds at which the contact closes and at which its overlap reaches the limit, m/s.
        double spring = 0, resistance = 0, closing_speed = 0, limit_speed = 0;
        Vec3 velocity_before = Vec3::Zero();  // m/s, relative, before the impulses of a substep
        double push = 0;                      // N s, normal impulse of this substep
        Vec3 drag = Vec3::Zero();             // N s, friction of this substep
        Vec3 impulse = Vec3::Zero();          // N s, accumulated over the step
        double taken = 0;                     // J, energy taken in the step
        bool touched = false;                 // within the step
    };
    void add_loads();
    ImpulseRow make_row(std::uint32_t index);
    void add_incidence(std::uint32_t first, std::uint32_t part, std::uint32_t phyxel, double weight);
    void make_spring(ImpulseRow& row) const;
    void continue_row(ImpulseRow& row, const CachedContact& cached) const;
    void limit_lift(double needed, double available);
    double gap_of(const ImpulseRow& row, ConstField position, double done) const;
    Vec3 relative_velocity(const ImpulseRow& row, ConstField velocity) const;
    void apply(const ImpulseRow& row, const Vec3& impulse, Field velocity) const;
    double improve(ImpulseRow& row, Field velocity) const;
    void solve(Field velocity, double warm_share);
    void add_up();

    ContactInput input_;
    double dt_ = 0;
    double last_duration_ = 0;  // s, that the impulses of the rows belong to
    std::vector<Part> parts_;
    std::vector<ImpulseRow> rows_;
    std::vector<Incidence> incidences_;
    std::vector<std::vector<std::uint32_t>> touched_;  // per part
    std::vector<std::vector<double>> load_;            // per part, per phyxel: sum of weights of its contacts
    std::vector<std::span<const Vec3>> velocity_;      // m/s, per part, that solve changes
    std::vector<CachedContact> next_;
    std::vector<Vec3> spring_force_;  // N, per attachment spring
};

}  // namespace splitcubes::meshless
