// Placement of the phyxels of a solid.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/box.h>

#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Returns the point of the material to use for a candidate, or nullopt. Called on several threads at once.
using ProjectIntoMaterial = std::function<std::optional<Vec3>(const Vec3&)>;

/// Returns rest positions (m) for the phyxels of a solid. Candidates form a regular
/// lattice of the given spacing centred in `box` (x fastest); each is passed to
/// `place_in_material`, and of two samples closer than half the spacing the earlier
/// is kept. Then, in order, each point of `must_cover` that has no sample within
/// `cover_radius` becomes a sample itself.
/// Throws InputError when the box is empty, spacing or cover_radius is not
/// positive or the lattice would have more than 2^27 points.
std::vector<Vec3> sample_solid(const geometry::Box& box, double spacing,
                               const ProjectIntoMaterial& place_in_material, std::span<const Vec3> must_cover,
                               double cover_radius, const Parallel& parallel = Parallel(1));

}  // namespace splitcubes::meshless
