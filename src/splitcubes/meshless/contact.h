// What pushes on what during a step: contacts and pulls, whoever found them.
#pragma once

#include <splitcubes/math/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// One side of a contact: a point that moves as the weighted mean of some phyxels.
struct ContactSide {
    static constexpr std::size_t most = 8;

    std::uint32_t part = 0;   // which of the bodies that step together
    std::uint32_t count = 0;  // of phyxels; 0: a collider
    std::array<std::uint32_t, most> phyxel{};
    std::array<double, most> weight{};  // sum 1

    bool is_collider() const { return count == 0; }
};

/// Two points that may not pass each other along a direction during a step.
struct Contact {
    std::uint64_t key = 0;        // the same from step to step; contacts are sorted by it, each once
    ContactSide upper, lower;     // the lower one may be a collider
    Vec3 normal = Vec3::UnitZ();  // unit, world, from the lower to the upper side
    double gap = 0;               // m, along the normal at the start of the step; negative: overlap
    Vec3 surface_displacement = Vec3::Zero();  // m, way of the collider's point in the step
    double friction = 0;                       // Coulomb coefficient, >= 0
    double max_depenetration = 0;  // m, how much of an overlap that it began with is undone in a step, > 0
};

/// A phyxel that is pulled to a place by a spring; the pulls of one handle together
/// by no more than its limit.
struct HandleSpring {
    std::uint32_t part = 0;
    std::uint32_t phyxel = 0;
    std::uint32_t handle = 0;
    Vec3 target = Vec3::Zero();  // m, world, at the end of the step
    double stiffness = 0;        // N/m, > 0
};

/// What a contact remembers of the step before.
struct CachedContact {
    std::uint64_t key = 0;
    Vec3 tangential_displacement =
        Vec3::Zero();           // m, world: how far the two points are from where they would not rub
    double normal_force = 0;    // N, > 0
    Vec3 force = Vec3::Zero();  // N, world, on the upper side
    double stiffness = 0;       // N/m, of its spring; 0 where it has none
    double rest_gap = 0;        // m, the gap above which nothing pushes, <= 0
    double energy = 0;  // J, that its spring held when the step began, less the work that it did in it

    /// For checkpoints.
    template <class Archive>
    void serialize(Archive& archive) {
        archive(key, tangential_displacement, normal_force, force, stiffness, rest_gap, energy);
    }
};

/// Everything that pushes and pulls in a step. `memory`: of the last step, sorted by
/// key; the solver replaces it.
struct ContactInput {
    std::span<const Contact> contacts;
    std::span<const HandleSpring> handle_springs;
    std::span<const double> handle_force_limits;  // N, per handle
    std::vector<CachedContact>* cached = nullptr;
    std::vector<Vec3>* handle_forces = nullptr;  // N, world, per handle, of the solved step; written

    bool empty() const { return contacts.empty() && handle_springs.empty(); }
};

/// Ground: the half space normal . x >= offset is free.
struct GroundPlane {
    Vec3 normal = Vec3::UnitZ();  // unit, world
    double offset = 0;            // m
    double friction = 0;          // Coulomb coefficient, >= 0
};

/// Weighted mean of a side; zero for a collider. `field`: per part, one entry a phyxel.
template <class Field>
Vec3 side_value(const ContactSide& side, const Field& field) {
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t k = 0; k < side.count; ++k) sum += side.weight[k] * field[side.part][side.phyxel[k]];
    return sum;
}

/// Finds what is remembered of contacts. Quick where they are asked for in ascending order of their keys.
class CachedContactFinder {
  public:
    /// memory: sorted by key, for as long as this lives; nullptr: nothing is remembered.
    explicit CachedContactFinder(const std::vector<CachedContact>* cached) {
        if (cached) all_ = *cached;
    }
    /// nullptr where the contact is new.
    const CachedContact* find(std::uint64_t key);

  private:
    std::span<const CachedContact> all_;
    std::size_t at_ = 0;      // the first that is not below the last key
    std::uint64_t last_ = 0;  // key
    bool is_placed_ = false;
};

}  // namespace splitcubes::meshless
