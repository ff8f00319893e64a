// Rasterises packs of triangles into the bit masks of an occlusion disk.
#pragma once

#include <splitcubes/occlusion/cpu/rasterize.h>

#include <array>
#include <cstdint>
#include <vector>

namespace splitcubes::occlusion::cpu {

/// A pack and its position.
struct PlacedPack {
    const geometry::OccluderPack* pack;
    std::array<float, 3> offset;  // of its centre in the disk's coordinates, disk radii
};

/// A triangle together with the apex that it is projected from.
struct ProjectedTriangle {
    std::uint32_t triangle;  // id in the grid
    int apex;                // 0, 1
};

/// Triangles near the pair of a disk. Keeps its memory from pair to pair.
struct NearPacks {
    std::vector<PlacedPack> packs;
    float extent = 0;  // max distance of a corner from its pack's centre along an axis, disk radii
    std::vector<ProjectedTriangle> leftover;  // triangles for `rasterize`

    void clear() {
        packs.clear();
        extent = 0;
        leftover.clear();
    }
};

/// Adds the triangles of the packs to the masks. Each is projected from either apex to the raster; in a row,
/// a side is crossed at one column, known to within a bound of the rounding error. Columns within that bound
/// of a side are decided in double precision, so the masks equal those of rays in double precision on every
/// machine. Triangles that extend behind an apex or are seen edge-on are appended to near.leftover instead.
void rasterize_packs(const Disk& disk, const DiskRaster& raster, const geometry::OccluderGrid& occluders,
                     NearPacks& near, DiskMasks& masks);

/// Buffers of masks_of; one per thread.
struct Buffers {
    NearPacks near;
    TriangleList others;
};

/// Returns the masks of a disk, whose phyxels do not coincide; empty if no triangle is near.
DiskMasks masks_of(const geometry::OccluderGrid& occluders, const PairQuery& pair, const Disk& disk,
                   const DiskRaster& raster, Buffers& buffers);

}  // namespace splitcubes::occlusion::cpu
