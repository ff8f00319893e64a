// Rasterises packs of triangles into the bit masks of an occlusion disk.
#pragma once

#include <splitcubes/occlusion/cpu/rasterize.h>

#include <array>
#include <cstdint>
#include <vector>

namespace splitcubes::occlusion::cpu {

/// A pack and where it stands.
struct PlacedPack {
    const geometry::OccluderPack* pack;
    std::array<float, 3> offset;  // of its centre in the disk's coordinates, disk radii
};

/// A triangle seen from one apex.
struct Sight {
    std::uint32_t triangle;  // id in the grid
    int apex;                // 0, 1
};

/// What the two phyxels of a disk may see. Keeps its memory from pair to pair.
struct NearPacks {
    std::vector<PlacedPack> packs;
    float extent = 0;           // of any corner from its pack's centre along an axis, disk radii
    std::vector<Sight> sights;  // what is to be rasterised otherwise

    void clear() {
        packs.clear();
        extent = 0;
        sights.clear();
    }
};

/// Adds the triangles of the packs to the masks. Each is projected from either
/// apex to the raster; in a row, a side is met at one column, known to within a
/// bound of the rounding error. Columns within that bound of a side are decided
/// in double precision, so the masks are those of rays in double precision, the
/// same on every machine. Triangles that reach behind an apex or are seen on edge
/// are appended to near.sights instead.
void rasterize_packs(const Disk& disk, const DiskRaster& raster, const geometry::OccluderGrid& occluders,
                     NearPacks& near, DiskMasks& masks);

/// Buffers of masks_of; one a thread.
struct Buffers {
    NearPacks near;
    TriangleList others;
};

/// The masks of a disk, whose phyxels do not coincide; empty where nothing is near.
DiskMasks masks_of(const geometry::OccluderGrid& occluders, const PairQuery& pair, const Disk& disk,
                   const DiskRaster& raster, Buffers& buffers);

}  // namespace splitcubes::occlusion::cpu
