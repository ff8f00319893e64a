// Colliders as rigid pieces meet them in a step.
#pragma once

#include <splitcubes/geometry/signed_distance.h>

namespace splitcubes::meshless {

/// A collider for rigid pieces, with its motion in a step.
struct Obstacle {
    const geometry::SignedDistance* solid = nullptr;  // in its own coordinates
    Isometry before = Isometry::Identity();           // world from own coordinates, at the start of the step
    Isometry after = Isometry::Identity();            // world from own coordinates, at the end of the step
    double friction = 0;                              // Coulomb coefficient, >= 0
};

}  // namespace splitcubes::meshless
