// Contacts and pulls as springs within the implicit step's linear solve.
#pragma once

#include <splitcubes/meshless/contact.h>
#include <splitcubes/meshless/contact_products.h>
#include <splitcubes/meshless/loops.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace splitcubes::meshless {

using Field = std::span<const std::span<Vec3>>;             // per part, per phyxel
using ConstField = std::span<const std::span<const Vec3>>;  // per part, per phyxel

/// Compliant contacts, linearised like the elastic forces: where the gap g at the end of
/// the step is below what is allowed, the force k (allowed - g) along the normal, and
/// along the plane a spring to the place where the two points met, whose force is cut
/// off at friction times that (an elastic slider; Cundall and Strack 1979). The spring's length is
/// carried from step to step, so nothing creeps that sticks. k is 2.5 times the stiffness that the
/// phyxels of the contact show in the solve, and stays while the contact pushes: the force has a potential,
/// so that what rolls from contact to contact gains nothing. Allowed is zero, or the overlap that the contact
/// began with. Where a hit would go deeper by more than a little in one step the solve is repeated with what
/// it went deeper added to what is allowed, for that step (augmented Lagrangian): that work is never
/// positive.
///
/// Pulls are springs whose sum over a handle is cut off at its limit in the same way.
///
/// Sums run in the order of the contacts: the same bits for any number of threads.
class ContactForces {
  public:
    /// What a step is about, one entry a part. Spans live as long as the step.
    struct Part {
        std::span<const Vec3> start;          // m, positions before the step
        std::span<const Vec3> velocity;       // m/s, before the step
        double coast = 0;                     // s, the step
        std::span<const double> mobility;     // m/N, inverse diagonal of the solve without contacts
        std::span<const std::uint8_t> fixed;  // per phyxel: 1: its place is prescribed
    };

    /// Forgets the last step, and lists the phyxels that contacts and pulls hold: touched().
    void begin(const ContactInput& input, std::span<const Part> parts);
    /// Makes the springs. Guess: where the touched phyxels will be about; it decides what
    /// begins as sliding.
    void make_springs(ConstField guess, const Parallel& parallel);
    bool empty() const { return rows_.empty() && handle_springs_.empty(); }
    /// Of a part: the phyxels that anything here depends on or changes, each once.
    std::span<const std::uint32_t> touched(std::uint32_t part) const { return touched_[part]; }

    /// Adds what the springs add to the solve's diagonal, N/m.
    void add_diagonal(std::uint32_t part, std::span<double> diagonal) const;
    /// Adds the forces that the springs have at these places, N.
    void add_forces(ConstField position, Field force, const Parallel& parallel);
    /// out += stiffness of the springs times in; returns in . (what was added).
    double apply(ConstField in, Field out) const;
    /// Makes the list of products() what the springs are now; whether it was something else.
    bool list_springs();
    ContactProducts& products() { return products_; }
    /// Compares the springs' forces with what contact and friction allow at these places.
    /// Where they differ by more than a few percent in all, changes the springs and
    /// returns true: the solve is to be repeated. only_add: none is let go (against going round
    /// in circles); a contact that pulls for a step does less harm than one that is missed. Adds to `change`
    /// by how much the springs' forces at these places changed, N.
    bool revise(ConstField position, bool only_add, Field change, const Parallel& parallel);
    /// Writes memory and pull forces of the step; marks phyxels that something pushes.
    void finish(ConstField position, std::span<const std::span<std::uint8_t>> touching,
                const Parallel& parallel);
    /// After finish: whether the contact of that number pushes.
    bool pushes(std::size_t contact) const { return pushes_[contact] != 0; }
    /// m, of the contacts' lifts; infinite where there are none.
    double min_depenetration() const { return min_depenetration_; }
    /// After finish: adds to each piece of a part by how much more it is pushed than a step ago, N.
    void add_changes(std::uint32_t part, std::span<const std::int32_t> piece, std::span<Vec3> change) const;
    /// Contacts that push, after finish.
    std::size_t pushing() const { return pushing_; }
    /// What the springs of contacts hold, J, after finish. What pushed back a hit is no spring.
    double energy() const { return energy_; }

  private:
    struct Row {
        std::uint32_t contact = 0;
        bool active = false;
        double normal = 0;                                     // N/m
        double tangent = 0;                                    // N/m, now; of a slider a share of its secant
        double rest_gap = 0;                                   // m, the gap above which nothing pushes, <= 0
        double depenetration = 0;                              // m, of an overlap, at most
        double push = 0;                                       // m, added to that for this step by a hit
        Vec3 tangential_displacement = Vec3::Zero();           // m, before the step
        Vec3 friction_force = Vec3::Zero();                    // N, friction as a given force
        Vec3 start = Vec3::Zero();                             // m, upper less lower before the step
        double normal_force = 0;                               // N, last known
        Vec3 last_force = Vec3::Zero(), force = Vec3::Zero();  // N, of the last step and of this
    };
    struct Spring {
        HandleSpring pull;
        double stiffness = 0;  // N/m, now
    };
    /// Of the making of rows.
    struct OverlapSums {
        // J, of skins: what the last step left, what the springs hold as they are found, and what undoing
        // would add to that.
        double left = 0, held = 0, wanted = 0;
        double depenetration = 0;                                            // m, of all
        double max_depenetration = std::numeric_limits<double>::infinity();  // m, the least
        std::size_t none = 0;                                                // rows of nothing that moves
        OverlapSums& operator+=(const OverlapSums& other) {
            left += other.left;
            held += other.held;
            wanted += other.wanted;
            depenetration += other.depenetration;
            max_depenetration = std::min(max_depenetration, other.max_depenetration);
            none += other.none;
            return *this;
        }
    };
    static Vec3 coasting(const Contact& contact, std::span<const Part> parts);
    Vec3 relative(const Row& row, ConstField position) const;
    Vec3 spring_force(const Row& row, const Vec3& way) const;
    Vec3 admissible_force(const Row& row, const Vec3& way, double& tangent) const;
    void touch(std::uint32_t part, std::uint32_t phyxel, double weight);
    Row make_row(std::uint32_t number, const CachedContact* cached, ConstField guess,
                 OverlapSums& sums) const;
    double load_of(const ContactSide& side) const;
    static double held_by(const Row& row, double gap, const Vec3& tangential_displacement);
    void limit_depenetration(const OverlapSums& sums, const Parallel& parallel);
    void list_active();
    bool revise_handle_springs(ConstField position);

    ContactInput input_;
    std::vector<Part> parts_;
    std::vector<Row> rows_;
    std::vector<std::uint32_t> active_;  // rows
    std::vector<Vec3> force_;            // N, per active row, of add_forces
    std::vector<Spring> handle_springs_;
    std::vector<std::vector<double>> load_;            // per part, per phyxel: sum of weights of its contacts
    std::vector<std::vector<std::uint32_t>> touched_;  // per part
    double min_depenetration_ = 0;                     // m
    ChunkSumOf<OverlapSums> begin_sum_;
    std::vector<CachedContact> next_;
    /// Of finish, per active row.
    struct Ended {
        CachedContact cached;  // its pressure is zero where it does not push
        double energy = 0;     // J
    };
    Ended end_row(Row& row, ConstField position) const;
    std::vector<Ended> ended_;
    std::vector<std::uint8_t> pushes_;  // per contact
    /// Of revise, per row.
    struct Revision {
        bool active = false;
        double tangent = 0;                  // N/m
        double push = 0;                     // m
        Vec3 friction_force = Vec3::Zero();  // N
        Vec3 way = Vec3::Zero();             // m
        Vec3 used = Vec3::Zero();            // N, before
        Vec3 more = Vec3::Zero();            // N, what that changes by
        bool is_same = true;                 // nothing changes
    };
    /// Forces, N.
    struct ForceSums {
        double wrong = 0, all = 0;  // N, of what is used and of what the law says
        ForceSums& operator+=(const ForceSums& other) {
            wrong += other.wrong;
            all += other.all;
            return *this;
        }
    };
    ForceSums revise_row(std::size_t r, ConstField position, bool only_add);
    void take_revision(std::size_t r);
    void take_revisions(ConstField position, Field change, const Parallel& parallel);
    std::vector<Revision> revisions_;
    std::vector<Vec3> handle_forces_;  // N, per handle
    bool listed_ = false;              // products_ are those of the rows
    bool same_rows_ = false;           // but for their stiffness
    ContactProducts products_;
    std::vector<std::size_t> phyxel_count_;        // per part
    std::vector<double> handle_stiffness_before_;  // N/m, per pull
    ChunkSumOf<ForceSums> revise_sum_;
    std::size_t pushing_ = 0;
    double energy_ = 0;  // J
};

/// Per contact: known, 1 where it is remembered; impact, 1 where the two sides, not touching before, close
/// the gap within the step by their velocities alone.
void find_impacts(const ContactInput& input, ConstField velocity, double dt, const Parallel& parallel,
                  std::vector<std::uint8_t>& known, std::vector<std::uint8_t>& impact);

}  // namespace splitcubes::meshless
