// Surface triangles in single-precision structure-of-arrays layout for vector code.
#pragma once

#include <splitcubes/geometry/box.h>

#include <array>
#include <cstdint>
#include <vector>

namespace splitcubes::geometry {

/// Up to 16 triangles near each other.
struct OccluderPack {
    static constexpr std::size_t width = 16;
    // [corner][axis][lane], m relative to PackedTriangles::centre, rest axes; NaN in empty
    // lanes.
    alignas(64) float corner[3][3][width];
    alignas(64) std::uint32_t id[width];  // what OccluderGrid::triangle takes
    std::uint32_t used = 0;               // bit per lane
    std::uint32_t boundary = 0;           // bit per lane: OccluderTriangle::boundary
    std::uint64_t blocks = 0;             // bit per block that has triangles here
    std::array<std::uint8_t, width> cell{};
    std::array<float, 3> low{}, high{};  // box of the corners, m relative to the centre

    OccluderPack();
};

/// The triangles of the cells of a brick, in packs. Replacing those of a cell costs time
/// proportional to the packs of the brick.
class PackedTriangles {
  public:
    /// centre: m, rest space, the origin of the packed coordinates.
    explicit PackedTriangles(const Vec3& centre) : centre_(centre) {}

    /// Adds a triangle. cell: 0 .. 63. block: id of a group of adjacent cells, 0 .. 63;
    /// triangles of one block preferably share packs.
    void add(std::uint8_t cell, std::uint8_t block, const std::array<Vec3, 3>& corner, bool boundary,
             std::uint32_t id);
    /// Removes the triangles of the cell.
    void remove(std::uint8_t cell);

    const Vec3& centre() const { return centre_; }
    /// m, largest distance along an axis from the centre to any corner added so far.
    float extent() const { return extent_; }
    /// Calls use(const OccluderPack&) for each pack whose box meets a box given in m relative to the centre.
    template <class Use>
    void visit(const std::array<float, 3>& low, const std::array<float, 3>& high, const Use& use) const {
        for (const OccluderPack& pack : packs_) {
            unsigned apart = 0;
            for (std::size_t k = 0; k < 3; ++k)
                apart |= unsigned{pack.low[k] > high[k]} | unsigned{low[k] > pack.high[k]};
            if (apart == 0) use(pack);
        }
    }

  private:
    Vec3 centre_;
    float extent_ = 0;
    std::vector<OccluderPack> packs_;
};

}  // namespace splitcubes::geometry
