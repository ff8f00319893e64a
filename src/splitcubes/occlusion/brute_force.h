// Occlusion disks by ray casting.
#pragma once

#include <splitcubes/occlusion/disk.h>

namespace splitcubes::occlusion {

/// Returns the masks of a pair: tests each sample's two rays against every nearby triangle, in double
/// precision. The pair's phyxels must not coincide.
DiskMasks brute_force_masks(const geometry::OccluderGrid& occluders, const PairQuery& pair,
                            const DiskRaster& raster);

}  // namespace splitcubes::occlusion
