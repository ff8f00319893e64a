// The occlusion disk of a pair: its frame, its samples and what becomes of the
// masks. Shared by the backends.
#pragma once

#include <splitcubes/occlusion/visibility.h>

#include <array>
#include <cstdint>

namespace splitcubes::occlusion {

/// Depths between which a ray from an apex counts, in disk radii: 1e-3 of the
/// phyxels' distance after the apex, and as much past the disk at depth 1.
inline constexpr double near_depth = 2e-3;
inline constexpr double far_depth = 1 + 2e-3;

/// Local coordinates of a pair. Seen from `apex`: X and Y in the disk's plane, Z
/// the depth towards the other phyxel, all in disk radii; the disk is the unit
/// disk about (0, 0, 1). Seen from the other phyxel, which is at (0, 0, 2), the
/// same point has depth 2 - Z and the sample (x, y) is the same one.
struct Disk {
    Vec3 apex;      // m, rest space: of the two phyxels the first in lexicographic order
    double radius;  // m
    Mat3 axes;      // rows: unit X, Y, Z axis over the radius, 1/m

    Vec3 local(const Vec3& rest) const { return axes * (rest - apex); }
};

/// Whether the phyxels lie too close together for a disk (1e-160 m).
inline bool coincide(const PairQuery& pair) {
    return !((pair.b - pair.a).squaredNorm() > 0);
}

/// The same disk, to the bit, for (a, b) and (b, a). The two must not coincide.
Disk make_disk(const PairQuery& pair);

constexpr std::size_t max_disk_words = 32 * 32 / 64;

/// One bit per texel, row after row; bit (row * size + column).
using DiskBits = std::array<std::uint64_t, max_disk_words>;

/// The raster of a disk: texels whose centres lie in it.
struct DiskRaster {
    int size;           // texels a side
    std::size_t words;  // of DiskBits in use
    int sample_count;
    DiskBits samples{};  // texels that are samples

    /// Throws InputError unless size is 8, 16 or 32.
    explicit DiskRaster(int size);
    /// Coordinate of the centre of a column or row, in disk radii; exact.
    double coordinate(int k) const { return (2 * k + 1) / static_cast<double>(size) - 1; }
};

/// What the rays of a disk met. Bits beside the samples mean nothing.
struct DiskMasks {
    DiskBits obscured{};  // seen from one apex or the other
    DiskBits outside{};   // parted from the first apex by boundary triangles an odd number of times
};

/// Whether the ray from an apex to sample (x, y) crosses the triangle, given in
/// that apex's local coordinates, within the depths. A ray through an edge or a
/// vertex counts as if the sample were moved by infinitesimals (e1 >> e2 >> e3),
/// so it crosses a closed surface as often as one beside it (simulation of
/// simplicity, Edelsbrunner and Muecke 1990). orientation +1 or -1: counts only
/// triangles that wind that way about the ray.
bool ray_crosses(const std::array<Vec3, 3>& local, double x, double y, int orientation);

/// Samples of a disk.
struct DiskCounts {
    int inside = 0;   // within the body
    int visible = 0;  // of those, not obscured
};

DiskCounts count_samples(const DiskMasks& masks, const DiskRaster& raster);

/// visibility of a pair from its samples; the plain segment between the phyxels
/// where none is inside.
float visibility_of(const DiskCounts& counts, const geometry::OccluderGrid& occluders, const PairQuery& pair,
                    const VisibilityOptions& options);
/// visibility of a pair from its masks; the plain segment between the phyxels
/// where no sample is inside.
float visibility_of(const DiskMasks& masks, const DiskRaster& raster, const geometry::OccluderGrid& occluders,
                    const PairQuery& pair, const VisibilityOptions& options);

/// Throws InputError for options out of range.
void check_options(const VisibilityOptions& options);

}  // namespace splitcubes::occlusion
