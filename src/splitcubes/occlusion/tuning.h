#pragma once

/// Tuning constants of visibility between phyxels. The depth range of occlusion disks (disk.h) and the share
/// of the transparency criterion (segment_criteria.h; Organ et al. 1996) define results and stay with their
/// interfaces.

namespace splitcubes::occlusion::tuning {

/// Boxes of influence of a pair (criterion.cpp).
namespace criteria {

/// Share of the distance, 1e-9 to 1e-2, that exceeds the rounding of segment tests: boxes in which a change
/// may affect a pair grow by it. Larger evaluates more pairs again; smaller may miss changes.
inline constexpr double box_margin = 1e-5;

}  // namespace criteria

/// Rasterised disks (cpu/packs.cpp).
namespace disks {

/// Disk radii, 0.01 to 0.5: minimum depth of triangles that are projected; nearer ones are tested one by one,
/// as their projection is too large for single precision. Affects time only.
inline constexpr float min_projected_depth = 0.0625F;

}  // namespace disks

}  // namespace splitcubes::occlusion::tuning
