// Contacts and attachment springs as linear springs within the implicit step's solve.
#pragma once

#include <splitcubes/contact/response/contact.h>
#include <splitcubes/contact/response/contact_products.h>
#include <splitcubes/samples/loops.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace splitcubes::meshless {

using Field = std::span<const std::span<Vec3>>;             // per part, per phyxel
using ConstField = std::span<const std::span<const Vec3>>;  // per part, per phyxel

/// Compliant contacts, linearised like the elastic forces. If the gap g at the end of the step is below the
/// rest gap, the normal force is k (rest_gap - g). In the tangent plane a spring pulls the two points back to
/// where they met; its force is capped at friction times the normal force (elastic slider; Cundall and Strack
/// 1979). The stretch of that spring is carried from step to step, so sticking contacts do not creep.
///
/// The stiffness k is 2.5 times the stiffness that the contact's phyxels show in the solve, but at most 50
/// times the inertia of the pieces that touch. It stays constant while the contact is active, unless the
/// overlap exceeds a fiftieth of a spacing; a spring that is stiffened keeps its force. The force therefore
/// has a potential, and a body that rolls from contact to contact gains no energy. The rest gap is zero, or
/// the overlap at which the contact was first found; on a collider it follows gaps that are found deeper than
/// they were left (CachedContact::rest_at). If an impact penetrates by more than a small amount in one step,
/// the solve is repeated with the rest gap raised by the excess for that step (augmented Lagrangian); the
/// work of this offset is never positive.
///
/// Attachment springs are linear; the sum over a handle is capped at the handle's limit in the same way.
///
/// Sums run in the order of the contacts: the same bits for any number of threads.
class ContactForces {
  public:
    /// Input of a step, one entry per part. The spans must stay valid during the step.
    struct Part {
        std::span<const Vec3> start;          // m, positions before the step
        std::span<const Vec3> velocity;       // m/s, before the step
        double dt = 0;                        // s, the time step
        std::span<const double> mobility;     // m/N, inverse diagonal of the system matrix without contacts
        std::span<const std::uint8_t> fixed;  // per phyxel; 1: position is prescribed
        std::span<const std::int32_t> piece;  // per phyxel, its piece, or -1; may be empty
        std::span<const double> piece_mass;   // kg, per piece; infinite if it is held
    };

    /// Discards the previous step and lists the phyxels that contacts and attachment springs act on:
    /// touched().
    void begin(const ContactInput& input, std::span<const Part> parts);
    /// Creates the springs. guess: approximate positions of the touched phyxels at the end of the step; it
    /// decides which contacts start out sliding. weight: N, of all that may touch; forces much smaller than
    /// that need not obey the laws.
    void make_springs(ConstField guess, double weight, const Parallel& parallel);
    bool empty() const { return rows_.empty() && handle_springs_.empty(); }
    /// Returns the phyxels of a part that the springs depend on or act on, each once.
    std::span<const std::uint32_t> touched(std::uint32_t part) const { return touched_[part]; }

    /// Adds the springs' contribution to the diagonal of the system matrix, N/m.
    void add_diagonal(std::uint32_t part, std::span<double> diagonal) const;
    /// Adds the spring forces at the given positions, N.
    void add_forces(ConstField position, Field force, const Parallel& parallel);
    /// out += stiffness of the springs times in; returns the product of in and the added term.
    double apply(ConstField in, Field out) const;
    /// Updates products() to the current springs. Returns whether anything changed.
    bool list_springs();
    ContactProducts& products() { return products_; }
    /// Compares the spring forces with those that the contact and friction laws admit at the given positions.
    /// If they differ by more than a few percent in total, updates the springs and returns true: the solve
    /// must be repeated. The offsets that push back impacts change only once the other forces nearly obey the
    /// laws, since they move what a solve aims at. Adds the change of the spring forces at these positions to
    /// `change`, N.
    bool revise(ConstField position, Field change, const Parallel& parallel);
    /// Prepares excess_power for a motion of the touched phyxels along straight lines.
    void begin_search(ConstField from, ConstField to, const Parallel& parallel);
    /// Returns the derivative by t, at the share t of that motion, of the work by which the forces of the
    /// contact and friction laws exceed those of the springs, J.
    double excess_power(double t, const Parallel& parallel);
    /// Writes the cached contacts and the handle forces of the step. Marks the phyxels that take part in an
    /// active contact.
    void finish(ConstField position, std::span<const std::span<std::uint8_t>> touching,
                const Parallel& parallel);
    /// Returns whether a contact (by index) is active. Valid after finish.
    bool pushes(std::size_t contact) const { return pushes_[contact] != 0; }
    /// Returns the smallest max_depenetration of all contacts, m; infinite if there are none.
    double min_depenetration() const { return min_depenetration_; }
    /// Adds to each piece of a part the change of its contact force since the previous step, N. Valid after
    /// finish.
    void add_changes(std::uint32_t part, std::span<const std::int32_t> piece, std::span<Vec3> change) const;
    /// Returns the number of active contacts. Valid after finish.
    std::size_t pushing() const { return result_.pushing; }
    /// Returns the energy stored in contact springs, J. Valid after finish. Offsets that push back an impact
    /// do not count.
    double energy() const { return result_.energy; }
    /// Returns the work of the handles on the phyxels in the step, J. Valid after finish.
    double handle_work() const { return result_.handle_work; }

  private:
    struct ContactRow {
        std::uint32_t contact = 0;
        bool active = false;
        double normal = 0;         // N/m
        double tangent = 0;        // N/m, current; for a slider a share of its secant stiffness
        double rest_gap = 0;       // m, gap above which no force acts, <= 0
        double drift = 0;          // m, CachedContact::drift
        double depenetration = 0;  // m, maximum overlap removed in this step
        double offset = 0;         // m, impact offset added to rest_gap for this step
        Vec3 tangential_displacement = Vec3::Zero();  // m, stretch of the friction spring before the step
        Vec3 friction_force = Vec3::Zero();           // N, constant part of a slider's friction
        Vec3 start = Vec3::Zero();                    // m, upper minus lower point before the step
        double normal_force = 0;                      // N, of the previous step
        Vec3 last_force = Vec3::Zero(), force = Vec3::Zero();  // N, of the previous and of this step
    };
    struct HandleRow {
        HandleSpring given;
        double stiffness = 0;  // N/m, scaled so that the handle stays within its limit
    };
    /// Sums over the springs while they are created.
    struct RowSums {
        // J, of contacts between bodies: left over from the previous step, stored in the springs as found,
        // and required to remove the overlap.
        double energy_left = 0, energy_held = 0, energy_needed = 0;
        double depenetration = 0;                                            // m, summed
        double max_depenetration = std::numeric_limits<double>::infinity();  // m
        std::size_t immovable = 0;  // springs whose sides cannot move
        RowSums& operator+=(const RowSums& other) {
            energy_left += other.energy_left;
            energy_held += other.energy_held;
            energy_needed += other.energy_needed;
            depenetration += other.depenetration;
            max_depenetration = std::min(max_depenetration, other.max_depenetration);
            immovable += other.immovable;
            return *this;
        }
    };
    static Vec3 free_displacement(const Contact& contact, std::span<const Part> parts);
    Vec3 relative(const ContactRow& row, ConstField position) const;
    Vec3 spring_force(const ContactRow& row, const Vec3& displacement) const;
    Vec3 admissible_force(const ContactRow& row, const Vec3& displacement, double& tangent) const;
    void touch(std::uint32_t part, std::uint32_t phyxel, double weight);
    ContactRow make_row(std::uint32_t index, const CachedContact* cached, ConstField guess,
                        RowSums& sums) const;
    /// Inverse stiffnesses of a contact's sides, m/N.
    struct Mobility {
        double actual = 0, free = 0;  // with the holds, and without
    };
    void add_mobility(const ContactSide& side, Mobility& sum) const;
    double mass_of(const ContactSide& side) const;
    double inertia(const Contact& contact) const;
    double stiffness(const Contact& contact, const CachedContact* cached, double hardest) const;
    static double spring_energy(const ContactRow& row, double gap, const Vec3& tangential_displacement);
    void limit_depenetration(const RowSums& sums, const Parallel& parallel);
    void list_active();
    bool revise_handle_springs(ConstField position);
    double work_of_handles(ConstField position);

    ContactInput input_;
    std::vector<Part> parts_;
    std::vector<ContactRow> rows_;
    std::vector<std::uint32_t> active_;  // indices into rows_
    std::vector<Vec3> force_;            // N, per active row, scratch of add_forces
    std::vector<HandleRow> handle_springs_;
    std::vector<std::vector<double>> load_;            // per part, per phyxel: sum of weights of its contacts
    std::vector<std::vector<std::uint32_t>> touched_;  // per part
    double min_depenetration_ = 0;                     // m
    ChunkSumOf<RowSums> begin_sum_;
    std::vector<CachedContact> next_;
    /// Result of finish for an active row.
    struct Ended {
        CachedContact cached;  // its force is zero if the contact is inactive
        double energy = 0;     // J
    };
    Ended end_row(ContactRow& row, ConstField position) const;
    std::vector<Ended> ended_;
    std::vector<std::uint8_t> pushes_;  // per contact
    /// Result of revise for a row.
    struct Revision {
        bool active = false;
        double tangent = 0;                  // N/m
        double offset = 0;                   // m
        Vec3 friction_force = Vec3::Zero();  // N
        Vec3 displacement = Vec3::Zero();    // m
        Vec3 force_before = Vec3::Zero();    // N, before the revision
        Vec3 force_change = Vec3::Zero();    // N, change by the revision
        bool is_same = true;                 // `active` does not change
    };
    /// Sums over revised rows.
    struct ForceSums {
        double deviation = 0, total = 0;  // N, deviation from the admissible forces, and their sum
        Vec3 sliding = Vec3::Zero();      // N, summed deviation of friction where contacts slide
        ForceSums& operator+=(const ForceSums& other) {
            sliding += other.sliding;
            deviation += other.deviation;
            total += other.total;
            return *this;
        }
    };
    ForceSums revise_rows(ConstField position, bool keep_offsets, const Parallel& parallel);
    ForceSums revise_row(std::size_t r, ConstField position, bool keep_offset);
    void apply_revision(std::size_t r);
    void apply_revisions(ConstField position, Field change, const Parallel& parallel);
    std::vector<Revision> revisions_;
    double least_total_ = 0;  // N, forces are compared with no less than that
    /// Motion along which a solve may be shortened.
    struct Search {
        std::vector<Vec3> start, change;  // m, per row: displacement where it begins, and along it
        ChunkSumOf<double> sum;
    };
    Search search_;
    std::vector<Vec3> handle_forces_;  // N, per handle
    bool listed_ = false;              // products_ is up to date
    bool same_rows_ = false;           // products_ lists the active rows; only stiffnesses may differ
    ContactProducts products_;
    std::vector<std::size_t> phyxel_count_;        // per part
    std::vector<double> handle_stiffness_before_;  // N/m, per attachment spring
    ChunkSumOf<ForceSums> revise_sum_;
    /// Result of finish.
    struct Result {
        std::size_t pushing = 0;
        double energy = 0, handle_work = 0;  // J
    };
    Result result_;
};

/// Finds new contacts that close within the step. Writes per contact: known, 1 if it is cached; impact, 1 if
/// it is not cached and the velocities alone close the gap within the step.
void find_impacts(const ContactInput& input, ConstField velocity, double dt, const Parallel& parallel,
                  std::vector<std::uint8_t>& known, std::vector<std::uint8_t>& impact);

}  // namespace splitcubes::meshless
