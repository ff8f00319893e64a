// Contacts and attachment springs that act during a step, wherever they were found.
#pragma once

#include <splitcubes/math/types.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// One side of a contact: a point whose position is a weighted mean of phyxel positions.
struct ContactSide {
    static constexpr std::size_t max_phyxels = 8;

    std::uint32_t part = 0;   // index of the body within the group that steps together
    std::uint32_t count = 0;  // phyxels; 0: a collider
    std::array<std::uint32_t, max_phyxels> phyxel{};
    std::array<double, max_phyxels> weight{};  // sum 1

    bool is_collider() const { return count == 0; }
};

/// Two points that must not pass each other along a direction during a step.
struct Contact {
    std::uint64_t key = 0;        // stable across steps and unique; contacts are sorted by it
    ContactSide upper, lower;     // the lower one may be a collider
    Vec3 normal = Vec3::UnitZ();  // unit, world, from the lower to the upper side
    double gap = 0;  // m, separation along the normal at the start of the step; negative: overlap
    Vec3 surface_displacement = Vec3::Zero();  // m, motion of the collider's point in the step
    // m, by which the vector from the lower to the upper mean of phyxels changes in the step as both sides
    // rotate together; no relative motion.
    Vec3 turn_displacement = Vec3::Zero();
    double friction = 0;           // Coulomb coefficient, >= 0
    double max_depenetration = 0;  // m, maximum initial overlap removed in a step, > 0

    /// Returns how much of an overlap (m) that is no compression a step undoes.
    double depenetration(double overlap) const;
};

/// Spring that pulls a phyxel towards a target. The summed force of one handle's springs is capped at the
/// handle's limit.
struct HandleSpring {
    std::uint32_t part = 0;
    std::uint32_t phyxel = 0;
    std::uint32_t handle = 0;
    Vec3 target = Vec3::Zero();        // m, world, at the end of the step
    double stiffness = 0;              // N/m, > 0
    Vec3 start_target = Vec3::Zero();  // m, world, at the start of the step; for the work only
};

/// Returns the factor that keeps a handle's summed force, N, within its limit, N.
inline double share_within_limit(const Vec3& force, double limit) {
    const double size = force.norm();
    return size > limit ? limit / size : 1;
}

/// State of a contact that persists from one step to the next.
struct CachedContact {
    std::uint64_t key = 0;
    // m, world: stretch of the friction spring; zero where the two points exert no friction.
    Vec3 tangential_displacement = Vec3::Zero();
    double normal_force = 0;    // N, > 0
    Vec3 force = Vec3::Zero();  // N, world, on the upper side
    double stiffness = 0;       // N/m, of the contact spring; 0 if there is none
    double rest_gap = 0;        // m, gap above which no force acts, <= 0
    double gap = 0;             // m, at the end of the step
    double drift = 0;           // m, part of the rest gap by which gaps were found deeper than left, <= 0
    double energy = 0;  // J, of the spring at the start of the step, minus the work it did in the step

    struct Rest {
        double gap, drift;
    };
    /// Returns rest gap and drift of the contact as it is found in the next step. A collider can be found
    /// nearer or farther than the contact was left, as the drawn surface does not move as the means of
    /// phyxels on which forces act. Taken for compression, the difference would do work that nothing put in.
    /// Another surface that is found deeper may be another face; one that is found farther has come apart.
    Rest rest_at(const Contact& found) const {
        const double jump = found.gap - gap;
        const double followed = std::min(0.0, rest_gap + jump);
        if (!found.lower.is_collider()) return {std::min(followed, rest_gap), 0};
        return {followed, std::clamp(drift + jump, followed, 0.0)};
    }

    /// For checkpoints.
    template <class Archive>
    void serialize(Archive& archive) {
        archive(key, tangential_displacement, normal_force, force, stiffness, rest_gap, gap, drift, energy);
    }
};

/// Contacts and attachment springs of a step. `cached` holds the state of the previous step, sorted by key;
/// the solver replaces it.
struct ContactInput {
    std::span<const Contact> contacts;
    std::span<const HandleSpring> handle_springs;
    std::span<const double> handle_force_limits;  // N, per handle
    std::vector<CachedContact>* cached = nullptr;
    std::vector<Vec3>* handle_forces = nullptr;  // N, world, per handle, of the solved step; output

    bool empty() const { return contacts.empty() && handle_springs.empty(); }
};

/// Ground plane; the half space normal . x >= offset is free.
struct GroundPlane {
    Vec3 normal = Vec3::UnitZ();  // unit, world
    double offset = 0;            // m
    double friction = 0;          // Coulomb coefficient, >= 0
};

/// Returns the weighted mean of `field` over a side; zero for a collider. `field`: per part, one entry per
/// phyxel.
template <class Field>
Vec3 side_value(const ContactSide& side, const Field& field) {
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t k = 0; k < side.count; ++k) sum += side.weight[k] * field[side.part][side.phyxel[k]];
    return sum;
}

/// Looks up cached contacts by key. Fast if queried in ascending order of keys.
class CachedContactFinder {
  public:
    /// cached: sorted by key, must outlive this object; nullptr: nothing is cached.
    explicit CachedContactFinder(const std::vector<CachedContact>* cached) {
        if (cached) all_ = *cached;
    }
    /// Returns nullptr if the contact is new.
    const CachedContact* find(std::uint64_t key);

  private:
    std::span<const CachedContact> all_;
    std::size_t at_ = 0;          // first entry whose key is not below the last queried one
    std::uint64_t last_key_ = 0;  // last queried key
    bool is_placed_ = false;
};

}  // namespace splitcubes::meshless
