// Contact of one surface point with one collider.
#pragma once

#include <splitcubes/contact/detection/collider.h>
#include <splitcubes/contact/response/contact.h>

#include <cstddef>
#include <cstdint>
#include <optional>

namespace splitcubes::body {

/// Returns the key of a contact of a surface vertex. other: 0 for another surface, 1 + index of a collider.
inline std::uint64_t contact_key(std::uint32_t body, std::size_t other, std::uint32_t vertex) {
    return static_cast<std::uint64_t>(body) << 48 | static_cast<std::uint64_t>(other) << 32 | vertex;
}

/// Set in the last 32 bits of the key of a contact of a phyxel with a collider; the others are its index.
inline constexpr std::uint32_t phyxel_bit = 1U << 31;

/// Poses of a collider at the beginning and the end of a step.
struct ColliderPoses {
    Isometry before, after;        // world from own
    Isometry to_before, to_after;  // own from world

    ColliderPoses(const Collider& collider, double time, double dt)
        : before(collider.at(time)),
          after(collider.at(time + dt)),
          to_before(before.inverse()),
          to_after(after.inverse()) {}
};

/// Point of a surface in a step; m, world.
struct SurfacePoint {
    Vec3 position;         // at the start, as its phyxels move it
    Vec3 drawn;            // at the start, of the drawn vertex
    Vec3 displacement;     // in the step
    double max_error = 0;  // distance to which the two positions may differ
};

/// Follows a point in the collider's own frame through the step, up to where it comes within `margin` (m) of
/// the solid (sphere tracing), so that fast points do not tunnel. The point is the one within max_error of
/// the drawn vertex that is nearest to where its phyxels move it. Returns the contact with the tangent plane
/// there, without key, upper side and maximum depenetration; nothing if the point stays away.
std::optional<meshless::Contact> touch(const Collider& collider, const ColliderPoses& poses,
                                       const SurfacePoint& point, double margin);

}  // namespace splitcubes::body
