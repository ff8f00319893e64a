// Rasterises triangles into the bit masks of an occlusion disk, from both apexes, on the widest vectors of
// the machine.
#pragma once

#include <splitcubes/occlusion/disk.h>

#include <span>
#include <vector>

namespace splitcubes::occlusion::cpu {

constexpr std::size_t block_size = 16;

/// Up to 16 triangles, laid out for vector code.
struct TriangleBlock {
    alignas(
        64) double corner[3][3][block_size];  // [corner][axis][triangle], m, rest frame, relative to the apex
    const geometry::OccluderTriangle* source[block_size];
    std::uint32_t seen[2];  // per apex: one bit per triangle
};

/// Triangles near a pair. Keeps its memory from pair to pair.
class TriangleList {
  public:
    void clear() { count_ = 0; }
    /// Adds a triangle. apexes: bits of the apexes that it is projected from.
    void add(const geometry::OccluderTriangle& triangle, const Vec3& apex, unsigned apexes = 3) {
        const std::size_t lane = count_ % block_size;
        if (count_ / block_size == blocks_.size()) blocks_.emplace_back();
        TriangleBlock& block = blocks_[count_++ / block_size];
        for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const auto k = static_cast<Eigen::Index>(axis);
                block.corner[c][axis][lane] = triangle.corner[c][k] - apex[k];
            }
        block.source[lane] = &triangle;
        for (std::size_t a = 0; a < 2; ++a) {
            if (lane == 0) block.seen[a] = 0;
            block.seen[a] |= (apexes >> a & 1) << lane;
        }
    }
    std::size_t count() const { return count_; }
    std::span<const TriangleBlock> blocks() const { return blocks_; }

  private:
    std::size_t count_ = 0;
    std::vector<TriangleBlock> blocks_;
};

/// Adds the triangles to the masks. Uses homogeneous edge functions (Olano and Greer 1997) in single
/// precision, so no clipping is needed: a sample's ray meets a triangle if three functions linear in the
/// sample's coordinates, and two more for the depths, are not negative. Each function is divided by a bound
/// of its rounding error; samples within the bound of zero, about one in ten thousand, are decided in double
/// precision. So the masks equal those of rays in double precision, with the same bits on every machine.
void rasterize(const Disk& disk, const DiskRaster& raster, const TriangleList& triangles, DiskMasks& masks);

/// Samples of a row that single precision leaves undecided for one triangle.
struct OpenSamples {
    const geometry::OccluderTriangle* triangle;
    int apex;         // 0, 1
    int orientation;  // of the triangle about the rays: +1, -1
    int row;
    std::uint32_t columns;  // bit per column
};

/// Decides undecided samples in double precision.
void resolve(const Disk& disk, const DiskRaster& raster, const OpenSamples& open, DiskMasks& masks);

}  // namespace splitcubes::occlusion::cpu
