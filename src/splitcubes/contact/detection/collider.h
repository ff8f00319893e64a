// Rigid colliders and contact options.
#pragma once

#include <splitcubes/geometry/signed_distance.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace splitcubes::body {

/// A static or kinematic solid: it pushes bodies and is not pushed.
struct Collider {
    std::string name;
    std::shared_ptr<const geometry::SignedDistance> solid;  // in its own frame
    std::function<Isometry(double time)> motion;            // world from own; empty: static
    double friction = 0.5;                                  // Coulomb coefficient, >= 0

    Isometry at(double time) const { return motion ? motion(time) : Isometry::Identity(); }
};

/// Contact between pieces and bodies.
struct ContactOptions {
    bool pieces = true;     // pieces and bodies push on each other, and cut faces of one piece, too
    double friction = 0.5;  // between them, Coulomb coefficient, >= 0
    std::optional<double> restitution = {};  // coefficient, 0 to 1, also of hits on colliders; none: no law
};

}  // namespace splitcubes::body
