// Things that do not deform: bodies push against them.
#pragma once

#include <splitcubes/geometry/signed_distance.h>

#include <functional>
#include <memory>
#include <string>

namespace splitcubes::body {

/// A still or moving solid. It pushes bodies and is not pushed.
struct Collider {
    std::string name;
    std::shared_ptr<const geometry::SignedDistance> solid;  // in its own frame
    std::function<Isometry(double time)> motion;            // world from own; empty: never moves
    double friction = 0.5;                                  // Coulomb coefficient, >= 0

    Isometry at(double time) const { return motion ? motion(time) : Isometry::Identity(); }
};

/// How pieces and bodies meet each other.
struct ContactOptions {
    bool pieces = false;    // push on each other, and cut faces of one piece on theirs
    double friction = 0.5;  // between them, Coulomb coefficient, >= 0
};

/// Pulls a region of a body along a path by springs of a limited force.
struct Handle {
    std::string name;
    std::function<bool(const Vec3& rest)> region;
    /// World from rest for what is grabbed, at a time.
    std::function<Isometry(double time)> motion;
    double stiffness = 1000;  // N/m, of the whole region
    double limit = 1e300;     // N, of the whole force
    double from = 0;          // s
    double until = 1e300;     // s
};

}  // namespace splitcubes::body
