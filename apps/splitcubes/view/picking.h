// Points of the deformed surface under the pointer, in coordinates of the material.
#pragma once

#include "published_state.h"
#include "vectors.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace splitcubes::view {

/// A point of a body's material: a triangle and weights, which move with it.
struct MaterialPoint {
    std::size_t body = 0;                     // index among the bodies
    std::array<std::uint32_t, 3> vertices{};  // slots
    std::array<double, 3> weights{};          // sum to 1
    Vec3 rest = Vec3::Zero();                 // m, rest space
    Vec3 world = Vec3::Zero();                // m, world, when it was picked
};

/// The point at which a half line meets a surface first.
struct Pick {
    MaterialPoint point;
    Vec3 normal = Vec3::UnitZ();              // unit, world, against the ray
    Mat3 world_from_rest = Mat3::Identity();  // rotation of the material there
    double distance = 0;                      // m, along the ray
    SurfaceOrigin origin = SurfaceOrigin::boundary;
};

std::optional<Pick> pick(const PublishedState& state, const Ray& ray);

/// The position that the point has now; nothing if the surface there has been replaced by a cut.
std::optional<Vec3> present_position(const MaterialPoint& point, const PublishedState& state);
std::optional<Vec3> present_position(const MaterialPoint& point, const SurfaceView& surface);

}  // namespace splitcubes::view
