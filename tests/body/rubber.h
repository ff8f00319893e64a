// Bodies of the contact tests.
#pragma once

#include <splitcubes/body/body_settings.h>
#include <splitcubes/geometry/shapes.h>

namespace splitcubes::body::fixtures {

inline geometry::TriangleMesh at(geometry::TriangleMesh mesh, const Vec3& offset) {
    for (Vec3& p : mesh.positions) p += offset;
    return mesh;
}

inline geometry::TriangleMesh box_at(const Vec3& size, const Vec3& offset) {
    return at(geometry::make_box(size), offset);
}

/// Two cells a phyxel spacing (m); moduli in Pa, damping in s.
inline BodySettings rubber(double spacing, double youngs_modulus = 1e5, double stiffness_damping = 0.003) {
    BodySettings out;
    out.cell_size = 0.5 * spacing;
    out.phyxel_spacing = spacing;
    out.material.youngs_modulus = youngs_modulus;
    out.material.poisson_ratio = 0.3;
    out.material.stiffness_damping = stiffness_damping;
    return out;
}

}  // namespace splitcubes::body::fixtures
