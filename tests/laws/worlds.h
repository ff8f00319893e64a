// Small worlds for property tests.
#pragma once

#include <splitcubes/body/body_settings.h>
#include <splitcubes/body/boundary_conditions.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/world/world.h>

#include <memory>
#include <utility>
#include <vector>

namespace splitcubes::laws {

inline std::shared_ptr<const Parallel> threads(int count) {
    return std::make_shared<const Parallel>(count);
}

/// Returns the settings of an empty world without gravity; every step is validated.
inline body::WorldSettings free_space(double time_step = 1.0 / 60) {
    body::WorldSettings settings;
    settings.time_step = time_step;
    settings.gravity = Vec3::Zero();
    settings.validate_each_step = true;
    return settings;
}

inline body::BodySettings soft(double cell_size, int phyxel_count) {
    body::BodySettings settings;
    settings.cell_size = cell_size;
    settings.phyxel_count = phyxel_count;
    settings.material.youngs_modulus = 2e5;
    settings.material.poisson_ratio = 0.33;
    return settings;
}

/// Makes the material on the side of the plane that the normal points to kinematic.
inline body::HoldConstraint hold_beyond(const Vec3& point, const Vec3& normal) {
    body::HoldConstraint hold;
    hold.region = [point, normal](const Vec3& rest) { return normal.dot(rest - point) >= 0; };
    hold.motion = [](double) { return Isometry::Identity(); };
    return hold;
}

/// Returns a straight edge from `low` to `high` that moves along a straight line at a constant rate; both are
/// divided into `subdivisions` parts.
inline cutting::Blade moving_blade(const Vec3& low, const Vec3& high, const Vec3& begin, const Vec3& end,
                                   double t0, double t1, int subdivisions = 1) {
    cutting::BladeShape shape;
    std::vector<cutting::Keyframe> path;
    std::vector<Vec3> line;
    for (int k = 0; k <= subdivisions; ++k) {
        const double share = static_cast<double>(k) / subdivisions;
        line.push_back(low + share * (high - low));
        path.push_back({t0 + share * (t1 - t0), begin + share * (end - begin), Quat::Identity()});
    }
    shape.polylines.push_back(std::move(line));
    return cutting::Blade("blade", std::move(shape), std::move(path));
}

/// Returns the share of the nodes in each piece.
inline std::vector<double> piece_shares(const splitting::Pieces& pieces) {
    std::vector<double> out;
    double total = 0;
    for (const std::size_t n : pieces.node_counts()) total += static_cast<double>(n);
    for (const std::size_t n : pieces.node_counts()) out.push_back(static_cast<double>(n) / total);
    return out;
}

inline double total_mass(const meshless::Phyxels& phyxels) {
    double sum = 0;
    for (const double m : phyxels.mass) sum += m;
    return sum;
}

}  // namespace splitcubes::laws
