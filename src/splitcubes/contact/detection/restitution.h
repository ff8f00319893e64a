// Restitution: how fast things part after a hit, relative to how fast they met.
#pragma once

#include <splitcubes/contact/detection/hit.h>
#include <splitcubes/contact/detection/touching_pairs.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes {
class StateHash;
class StateReader;
class StateWriter;
}  // namespace splitcubes

namespace splitcubes::body {

/// Newton's law of restitution for the rigid motion of pieces that hit colliders and each other: once a hit
/// is over, its sides part along its normal at the coefficient of restitution times the speed at which they
/// met. The solvers decide how a hit deforms the bodies, and how long it takes.
///
/// A hit begins with the first contact that pushes and ends with the last. Its normal and its point are means
/// over its contacts, weighted by their impulses; speeds are those of the rigid motions at this point, for a
/// ball those of its centre of mass. What the sides lack in speed an impulse at the point gives: once, when
/// strain no longer pushes them apart, and when they part. What they have in excess an impulse takes when
/// they part, or once strain holds little of it. An impulse that gives has friction.
///
/// An impulse gives no more energy than the pieces of the hit lost in it (Hit::held) and vibrate with when
/// they part. Between pieces it conserves both momenta. Hits as slow as what gravity does in a few steps have
/// no rebound, so bodies come to rest.
///
/// Pieces of which a part is held or pulled by a handle, rigid fragments and deformed bodies are left out.
/// Sums run in the order of phyxels and contacts: the same bits for any number of threads.
class Restitution {
  public:
    /// Changes of the sums over all bodies.
    struct Outcome {
        double kinetic_energy = 0;             // J
        double held_energy = 0;                // J, that hits may still give back
        Vec3 momentum = Vec3::Zero();          // kg m/s
        Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s, about the origin
    };

    /// Ends all hits.
    void clear() { hits_.clear(); }
    /// Records the state of the pieces. To be called immediately before the bodies are stepped, with the
    /// contacts of the last step.
    void begin(const HitTask& task, const Parallel& parallel);
    /// Leaves a piece out in this step, which a handle pulls.
    void leave_out(std::size_t body, std::int32_t piece) { step_.leave_out(body, piece); }
    /// Records the energies after the step. What pieces lose later is not counted.
    void measure(const HitTask& task);
    /// Advances the hits and gives their impulses; with the contacts of this step.
    Outcome finish(const HitTask& task, const Parallel& parallel);

    /// Indices above a removed one decrease by one.
    void remove_body(std::size_t index);
    void remove_collider(std::size_t index);
    /// For checkpoints.
    void save(StateWriter& writer) const;
    void load(StateReader& reader);
    void add_to_hash(StateHash& hash) const;

  private:
    bool is_whole(const Hit& hit) const;
    void match(const HitTask& task);
    void meet(const HitTask& task, const PairInStep& pair, Hit& hit) const;
    void add_contacts(const PairInStep& pair, Hit& hit) const;
    void credit_losses(const HitTask& task);
    double rebound(const HitTask& task, const Hit& hit) const;
    void add_depth(const HitTask& task, Hit& hit) const;
    Vec3 arm(const Hit& hit, std::size_t side) const;
    Vec3 velocity_change(const Hit& hit, const Vec3& impulse) const;
    Vec3 parting_velocity(const Hit& hit) const;
    double parting_speed(const Hit& hit) const;
    double parting_energy(const Hit& hit, double speed) const;
    double strain(const Hit& hit) const;
    double climb(const HitTask& task, const Hit& hit) const;
    bool advance(const HitTask& task, Hit& hit, const PairInStep* pair);
    void open(const HitTask& task, Hit& hit);
    void set_speed(Hit& hit, double speed, bool may_damp);
    double damp(const Hit& hit, double energy);
    void push(const Hit& hit, const Vec3& impulse);
    Outcome outcome() const;

    TouchingPairs step_;
    std::vector<Hit> hits_;                   // sorted by pair; all state
    std::vector<Hit> next_;                   // scratch of match
    std::vector<const PairInStep*> pair_of_;  // per hit, of this step; or null
    std::vector<double> share_;               // J, per group
    bool is_measured_ = false;
};

}  // namespace splitcubes::body
