// The occlusion disk of a pair: frame, samples and evaluation of the masks. Shared by the backends.
#pragma once

#include <splitcubes/occlusion/visibility.h>

#include <array>
#include <cstdint>

namespace splitcubes::occlusion {

/// Depth range of rays from an apex, in disk radii: from 1e-3 of the phyxels' distance after the apex to as
/// much past the disk, which is at depth 1.
inline constexpr double near_depth = 2e-3;
inline constexpr double far_depth = 1 + 2e-3;

/// Local coordinates of a pair, from `apex`: X and Y in the disk's plane, Z the depth towards the other
/// phyxel, all in disk radii; the disk is the unit disk about (0, 0, 1). From the other phyxel, which is at
/// (0, 0, 2), the same point has depth 2 - Z; the sample (x, y) is the same.
struct Disk {
    Vec3 apex;      // m, rest space: the lexicographically first of the two phyxels
    double radius;  // m
    Mat3 axes;      // rows: unit X, Y, Z axis over the radius, 1/m

    Vec3 local(const Vec3& rest) const { return axes * (rest - apex); }
};

/// Returns whether the phyxels are too close together for a disk (1e-160 m).
inline bool coincide(const PairQuery& pair) {
    return !((pair.b - pair.a).squaredNorm() > 0);
}

/// Returns the disk, with the same bits for (a, b) and (b, a). The two must not coincide.
Disk make_disk(const PairQuery& pair);

constexpr std::size_t max_disk_words = 32 * 32 / 64;

/// One bit per texel, row after row; bit (row * size + column).
using DiskBits = std::array<std::uint64_t, max_disk_words>;

/// The raster of a disk: texels whose centres are in it.
struct DiskRaster {
    int size;           // texels per side
    std::size_t words;  // of DiskBits that are used
    int sample_count;
    DiskBits samples{};  // texels that are samples

    /// Throws InputError unless size is 8, 16 or 32.
    explicit DiskRaster(int size);
    /// Returns the coordinate of the centre of a column or row, in disk radii; exact.
    double coordinate(int k) const { return (2 * k + 1) / static_cast<double>(size) - 1; }
};

/// Result of the rays of a disk. Bits of texels that are no samples are undefined.
struct DiskMasks {
    DiskBits obscured{};  // from one apex or the other
    DiskBits outside{};   // an odd number of boundary triangles lies between the sample and the first apex
};

/// Returns whether the ray from an apex to sample (x, y) crosses the triangle, given in that apex's local
/// coordinates, within the depth range. A ray through an edge or a vertex is treated as if the sample were
/// moved by infinitesimals (e1 >> e2 >> e3), so it crosses a closed surface as often as a neighbouring ray
/// (simulation of simplicity, Edelsbrunner and Muecke 1990). orientation: +1 or -1; only triangles with this
/// winding about the ray count.
bool ray_crosses(const std::array<Vec3, 3>& local, double x, double y, int orientation);

/// Sample counts of a disk.
struct DiskCounts {
    int inside = 0;   // the body
    int visible = 0;  // inside and not obscured
};

DiskCounts count_samples(const DiskMasks& masks, const DiskRaster& raster);

/// Returns the visibility of a pair from its sample counts, or that of the segment between the phyxels if no
/// sample is inside.
float visibility_of(const DiskCounts& counts, const geometry::OccluderGrid& occluders, const PairQuery& pair,
                    const VisibilityOptions& options);
/// Returns the visibility of a pair from its masks, or that of the segment between the phyxels if no sample
/// is inside.
float visibility_of(const DiskMasks& masks, const DiskRaster& raster, const geometry::OccluderGrid& occluders,
                    const PairQuery& pair, const VisibilityOptions& options);

/// Throws InputError for options out of range.
void check_options(const VisibilityOptions& options);

}  // namespace splitcubes::occlusion
