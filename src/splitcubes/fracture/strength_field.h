// Strength of a body's material at rest positions, and its weak planes.
#pragma once

#include <splitcubes/fracture/tear_settings.h>
#include <splitcubes/math/types.h>
#include <splitcubes/splitting/node_grid.h>

#include <optional>

namespace splitcubes::body {

/// Plane along which the strength is lowest.
struct WeakPlane {
    Vec3 point, normal;  // m, unit; rest space
};

/// Strength of a material that may vary with the rest position.
class StrengthField {
  public:
    /// The settings must have been checked. Evaluates the strength at every inside node of the grid.
    StrengthField(const TearSettings& settings, const splitting::NodeGrid& grid);

    const TearSettings& settings() const { return settings_; }
    /// Returns the strength at a rest position, Pa.
    double at(const Vec3& rest) const {
        return settings_.strength * (settings_.strength_factor ? settings_.strength_factor(rest) : 1);
    }
    /// Minimum of strength_factor over the inside nodes.
    double min_factor() const { return min_factor_; }
    /// Returns the plane along which the material within three cells of a rest position is weak, if there is
    /// one.
    std::optional<WeakPlane> weak_plane_at(const Vec3& rest) const;

  private:
    TearSettings settings_;
    double min_factor_ = 1;
    double cell_size_ = 0;  // m
};

}  // namespace splitcubes::body
