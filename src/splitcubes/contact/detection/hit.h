// A hit between two things, from the first contact that pushes to the last.
#pragma once

#include <splitcubes/math/types.h>

#include <array>
#include <compare>
#include <cstdint>
#include <limits>

namespace splitcubes::body {

/// Velocity of a rigid motion.
struct Twist {
    Vec3 velocity = Vec3::Zero();  // m/s, of the centre of mass
    Vec3 spin = Vec3::Zero();      // rad/s

    /// Returns the velocity, m/s, at an arm, m, from the centre of mass.
    Vec3 at(const Vec3& arm) const { return velocity + spin.cross(arm); }
};

/// Two things that touch: a piece, and a piece after it in the order of bodies and pieces, or a collider.
struct HitPair {
    static constexpr std::uint32_t collider = std::numeric_limits<std::uint32_t>::max();

    std::uint32_t body = 0, piece = 0;
    std::uint32_t other_body = 0;  // or `collider`
    std::uint32_t other = 0;       // piece, or index of the collider

    bool has_collider() const { return other_body == collider; }
    auto operator<=>(const HitPair&) const = default;
};

/// Phases of a pair that touches.
enum class HitPhase : std::uint32_t {
    resting,  // no hit: it met slowly, or its hit is over
    closing,  // the sides approach
    opening,  // strain pushes them apart
};

/// A pair that touches, and its hit. "First" is the piece of the pair, "second" the other side.
struct Hit {
    HitPair pair;
    HitPhase phase = HitPhase::resting;
    std::uint32_t stalled = 0;      // steps in which neither strain nor an impulse pushed the sides apart
    std::array<double, 2> mass{};   // kg, of the sides, 0: a collider; a hit ends when they change
    std::array<Twist, 2> approach;  // of the sides when they met; a collider has no spin
    double fall = 0;                // m^2/s^2, what gravity added to the square of the approach speed
    double friction = 0;            // Coulomb coefficient
    double blur = 0;                // m, offset of an arm from the normal that counts as none
    double impulse = 0;             // N s, along the normal
    Vec3 normal = Vec3::Zero();     // N s, sum of impulses, on the first side
    std::array<Vec3, 2> arm{Vec3::Zero(), Vec3::Zero()};  // N s m, weighted sums from centres of mass
    Vec3 surface = Vec3::Zero();                          // m/s, velocity of the collider at present
    double strain = 0;                                    // J, elastic energy of the pieces when they met
    double depth = 0;       // m, how much nearer the centres of mass are along the normal than when they met
    double last_speed = 0;  // m/s, at which they parted after the last step
    double spring = 0;      // J, in the springs of the contacts
    double held = 0;        // J, lost by the pieces so far, and not given back
    double given = 0;       // J

    /// Returns the unit normal, from the second side to the first.
    Vec3 unit_normal() const { return normal.normalized(); }
    /// Returns the mean arm of a side, m.
    Vec3 mean_arm(std::size_t side) const;
    /// Returns the speed at which the sides met at the present point, m/s.
    double approach_speed() const;
};

}  // namespace splitcubes::body
