// What a step does to pieces that touch: their rigid motions, energies, and the pairs that push.
#pragma once

#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/hit.h>
#include <splitcubes/contact/response/contact.h>
#include <splitcubes/core/parallel.h>
#include <splitcubes/samples/phyxels.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace splitcubes::body {

struct ContactIsland;

/// A step of all bodies, as Restitution sees it.
struct HitTask {
    std::span<const BodyView> bodies;
    std::span<const ContactIsland> islands;                // with the contacts of the step
    const std::vector<meshless::CachedContact>& contacts;  // that pushed in the last step, sorted by key
    Vec3 gravity = Vec3::Zero();                           // m/s^2
    double dt = 0;                                         // s
    double coefficient = 0;                                // of restitution, 0 to 1
};

/// Motion of a piece in a step.
struct PieceInStep {
    double mass = 0;                         // kg
    Twist before, solved, after;             // solved: after the step; after: with impulses, too
    Vec3 start = Vec3::Zero();               // m, centre of mass before the step
    Vec3 centre = Vec3::Zero();              // m, centre of mass after the step
    Mat3 inertia = Mat3::Zero();             // kg m^2, after the step
    Mat3 inverse_inertia = Mat3::Zero();     // 1/(kg m^2)
    double energy_before = 0, energy = 0;    // J, kinetic, elastic and potential
    double elastic_before = 0, elastic = 0;  // J
    double inner = 0;                        // J, kinetic energy beside that of the rigid motion
    double damped = 0;                       // J, to be taken from it
    bool left_out = false;                   // held, pulled by a handle or rigid
    bool supported = false;                  // touched something in the last step
    bool pushed = false;                     // by an impulse
};

/// What the contacts of a pair did in a step. Sums are weighted by impulse.
struct PairInStep {
    HitPair pair;
    double impulse = 0;                                    // N s, along the normals
    Vec3 normal = Vec3::Zero();                            // N s, on the first side
    Vec3 point = Vec3::Zero();                             // N m s, world, where the impulse acts
    Vec3 surface = Vec3::Zero();                           // N m, velocity of the collider
    double gap = std::numeric_limits<double>::infinity();  // m, smallest of contacts that push
    double friction = 0;                                   // Coulomb coefficient
    double spring = 0;                                     // J, in contact springs after the step
    double work = 0;      // J, by colliders and pieces that are left out, on the others
    bool pushes = false;  // at the end of the step
};

/// Rigid motions and energies of the pieces before and after a step, the pairs of them that touch, and what
/// groups of pieces that push on each other lost in it. Holds buffers only.
class TouchingPairs {
  public:
    static constexpr std::size_t no_slot = std::numeric_limits<std::size_t>::max();

    /// Records motions and energies before the step, with the contacts of the last one.
    void begin(const HitTask& task, const Parallel& parallel);
    /// Records the energies after the step.
    void measure(const HitTask& task);
    /// Records the motions after the step and lists the pairs; with the contacts of this step.
    void finish(const HitTask& task, const Parallel& parallel);
    /// Leaves a piece out in this step.
    void leave_out(std::size_t body, std::int32_t piece);

    /// Returns the index of a side's piece; no_slot: a collider or a piece that does not exist.
    std::size_t slot(const HitPair& pair, std::size_t side) const;
    PieceInStep& piece(std::size_t index) { return pieces_[index]; }
    const PieceInStep& piece(std::size_t index) const { return pieces_[index]; }
    /// Sorted by pair.
    std::span<const PairInStep> pairs() const { return pairs_; }
    /// Returns the group of pieces that push on each other to which a pair belongs.
    std::size_t group(const HitPair& pair) const;
    /// Returns the energy that a group lost in the step, J.
    double loss(std::size_t group) const { return loss_[group]; }
    /// Adds a loss, J, to that of the group of a pair.
    void add_loss(const HitPair& pair, double loss) {
        if (const std::size_t index = group(pair); index != no_slot) loss_[index] += loss;
    }
    std::size_t groups() const { return loss_.size(); }

    /// Writes the velocities of pushed pieces to the phyxels, with less vibration where it is damped. The
    /// time integration starts anew there.
    void apply(const HitTask& task) const;

  private:
    /// Start of a contact in a step.
    struct Start {
        Vec3 upper, lower;  // m, world
    };
    void add_energies(const HitTask& task, bool before);
    void read_motions(const HitTask& task, bool before, const Parallel& parallel);
    void leave_out_held(const HitTask& task);
    PairInStep pair_of(const HitTask& task, const ContactIsland& island, const meshless::Contact& contact,
                       const meshless::CachedContact* cached, const Start& start) const;
    void list_pairs(const HitTask& task);
    void sum_losses();

    std::vector<std::size_t> first_;   // per body: slot of its first piece; at last the number of slots
    std::vector<PieceInStep> pieces_;  // per slot
    std::vector<Start> starts_;        // per contact, island by island
    std::vector<PairInStep> pairs_;
    std::vector<std::size_t> group_;  // per slot
    std::vector<double> loss_;        // J, per group
    std::vector<meshless::Momenta> momenta_, partial_;
};

}  // namespace splitcubes::body
