// Occlusion disks ray by ray.
#pragma once

#include <splitcubes/occlusion/disk.h>

namespace splitcubes::occlusion {

/// The masks of a pair: each sample's two rays against every triangle near, in
/// double precision. The pair's phyxels must not coincide.
DiskMasks brute_force_masks(const geometry::OccluderGrid& occluders, const PairQuery& pair,
                            const DiskRaster& raster);

}  // namespace splitcubes::occlusion
