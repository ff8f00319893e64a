// Vectors, rotations, poses and ids of the public interface. Lengths are metres, times seconds, masses
// kilograms, angles radians.
#pragma once

#if defined(_MSVC_LANG) ? _MSVC_LANG < 202002L : __cplusplus < 202002L
#error "splitcubes needs C++20: compile with -std=c++20 or later"
#endif

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

/// The public interface; all that a program needs.
namespace splitcubes {

/// Three numbers; unless said otherwise a position in the world, m.
struct Vector3 {
    double x = 0;  ///< along the first axis
    double y = 0;  ///< along the second axis
    double z = 0;  ///< along the third axis, upwards
};

/// A rotation as a quaternion of any length above zero.
struct Quaternion {
    double w = 1;  ///< cosine of half the angle
    double x = 0;  ///< sine of half the angle times the axis
    double y = 0;  ///< see x
    double z = 0;  ///< see x
};

/// A rigid motion: world = position + rotation * own.
struct Pose {
    Vector3 position = {};     ///< m, world
    Quaternion rotation = {};  ///< world from own frame
};

/// A pose at a time.
struct TimedPose {
    double time = 0;  ///< s
    Pose pose;        ///< world from own frame
};

/// Names a thing of one Simulation, by value. Zero, as it starts, is none. An id is never given twice: after
/// its thing is removed every call refuses it (ErrorKind::unknown_id). Ids of two simulations may be equal;
/// keep them apart.
template <class Tag>
struct Id {
    std::uint32_t index = 0;       ///< for tables of the caller; used again after a removal
    std::uint32_t generation = 0;  ///< 0: names nothing

    /// Whether it names something, or something that was removed.
    explicit operator bool() const { return generation != 0; }
    /// Whether two ids name the same thing.
    friend bool operator==(const Id&, const Id&) = default;
    /// An order, for maps; it means nothing else.
    friend std::strong_ordering operator<=>(const Id&, const Id&) = default;
};

using BodyId = Id<struct BodyTag>;              ///< a soft body
using ToolId = Id<struct ToolTag>;              ///< a blade
using HandleId = Id<struct HandleTag>;          ///< springs that pull a region of a body
using ConstraintId = Id<struct ConstraintTag>;  ///< a region of a body that is held
using ColliderId = Id<struct ColliderTag>;      ///< a thing that does not deform

/// Elements first .. first + count - 1 of an array.
struct Range {
    std::uint32_t first = 0;  ///< of the elements
    std::uint32_t count = 0;  ///< how many
};

}  // namespace splitcubes

/// For unordered maps.
template <class Tag>
struct std::hash<splitcubes::Id<Tag>> {
    /// Hashes index and generation.
    std::size_t operator()(const splitcubes::Id<Tag>& id) const noexcept {
        return std::hash<std::uint64_t>()(std::uint64_t{id.generation} << 32 | id.index);
    }
};
