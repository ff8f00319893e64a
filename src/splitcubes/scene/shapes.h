// Shapes and placements of a scene; plain data like description.h.
#pragma once

#include <splitcubes/math/types.h>

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

namespace splitcubes::scene {

/// A turn about an axis through a pivot that the owner names; right-handed.
struct Rotation {
    Vec3 axis = Vec3::UnitZ();  // direction of any length above zero
    double angle_degrees = 0;
    bool operator==(const Rotation&) const = default;
};

// Shapes, in the body's own frame: centred at the origin, z up.

/// A mesh file; its coordinates are taken as metres before `scale`.
struct MeshShape {
    std::filesystem::path file;  // absolute: what the scene says, joined to the scene's folder
    std::string sha256{};        // of what the file holds; empty: whatever it holds
    bool operator==(const MeshShape&) const = default;
};
struct BoxShape {
    Vec3 size = Vec3::Ones();  // m, whole side lengths
    bool operator==(const BoxShape&) const = default;
};
struct SphereShape {
    double radius = 1;  // m
    bool operator==(const SphereShape&) const = default;
};
struct CylinderShape {
    double radius = 1;  // m
    double height = 1;  // m, whole, along z
    bool operator==(const CylinderShape&) const = default;
};
struct TorusShape {
    double ring_radius = 1;    // m, axis (z) to the middle of the tube
    double tube_radius = 0.3;  // m
    bool operator==(const TorusShape&) const = default;
};
struct CapsuleShape {
    double radius = 1;           // m
    double straight_height = 1;  // m, the part between the two half spheres, along z
    bool operator==(const CapsuleShape&) const = default;
};
struct PearShape {
    double height = 1;  // m, whole, along z
    double foot = 0;    // m, radius of the flat that it stands on; 0: none
    bool operator==(const PearShape&) const = default;
};
// Parts of an implicit shape.

struct BallPart {
    Vec3 center = Vec3::Zero();  // m
    Vec3 radii = Vec3::Ones();   // m, half axes along x, y, z
    bool operator==(const BallPart&) const = default;
};
/// A ball that moves from one point to another and changes its radius on the way.
struct ConePart {
    Vec3 from = Vec3::Zero();  // m
    Vec3 to = Vec3::UnitZ();   // m
    double from_radius = 1;    // m
    double to_radius = 1;      // m
    bool operator==(const ConePart&) const = default;
};
struct ImplicitPart {
    std::variant<BallPart, ConePart> form;
    Vec3 colour = Vec3::Constant(0.8);  // red, green, blue, sRGB, 0..1
    bool operator==(const ImplicitPart&) const = default;
};
/// The union of its parts, which flow into each other over `smoothness`.
struct ImplicitShape {
    double smoothness = 0;  // m; 0: sharp
    int cells = 96;         // of the grid that makes its mesh, along the longest side
    std::vector<ImplicitPart> parts;
    bool operator==(const ImplicitShape&) const = default;
};
using Shape = std::variant<MeshShape, BoxShape, SphereShape, CylinderShape, TorusShape, CapsuleShape,
                           PearShape, ImplicitShape>;

/// world = position + rotation (scale * own). The rotation is about the shape's origin.
struct PlacementDescription {
    Vec3 position = Vec3::Zero();  // m, world
    Rotation rotation;
    Vec3 scale = Vec3::Ones();  // > 0, per own axis
    bool operator==(const PlacementDescription&) const = default;
};

}  // namespace splitcubes::scene
