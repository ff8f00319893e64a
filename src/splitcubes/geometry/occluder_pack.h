// Surface triangles side by side in single precision, as vector code reads them.
#pragma once

#include <splitcubes/geometry/box.h>

#include <array>
#include <cstdint>
#include <vector>

namespace splitcubes::geometry {

/// Up to 16 triangles that lie near each other.
struct OccluderPack {
    static constexpr std::size_t width = 16;
    // [corner][axis][lane], m from the centre that they were packed about, rest axes, to
    // single precision; not a number where the lane is empty.
    alignas(64) float corner[3][3][width];
    alignas(64) std::uint32_t id[width];  // what OccluderGrid::triangle takes
    std::uint32_t used = 0;               // bit a lane
    std::uint32_t boundary = 0;           // bit a lane: skin of the body
    std::uint64_t blocks = 0;             // bit a block: of what the lanes hold
    std::array<std::uint8_t, width> cell{};
    std::array<float, 3> low{}, high{};  // box of the corners, m from the centre

    OccluderPack();
};

/// The triangles that the cells of a brick have handed over, in packs. Those of a
/// cell can be replaced at a cost that goes with the packs of the brick.
class PackedTriangles {
  public:
    /// About this point, m, rest space.
    explicit PackedTriangles(const Vec3& centre) : centre_(centre) {}

    /// cell: 0 .. 63. block: of cells near each other, 0 .. 63; those of one block
    /// share packs where there is room.
    void add(std::uint8_t cell, std::uint8_t block, const std::array<Vec3, 3>& corner, bool boundary,
             std::uint32_t id);
    /// Takes out what the cell has.
    void remove(std::uint8_t cell);

    const Vec3& centre() const { return centre_; }
    /// No corner that was ever added is farther than this from the centre along an axis, m.
    float extent() const { return extent_; }
    /// Calls use(const OccluderPack&) for each whose box meets a box given in m from the centre.
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
