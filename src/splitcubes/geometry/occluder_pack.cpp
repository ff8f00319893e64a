#include <splitcubes/geometry/occluder_pack.h>
#include <splitcubes/geometry/tuning.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace splitcubes::geometry {

namespace {

constexpr std::uint32_t all_lanes = 0xffff;

void refit(OccluderPack& pack) {
    pack.low.fill(std::numeric_limits<float>::infinity());
    pack.high.fill(-std::numeric_limits<float>::infinity());
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t c = 0; c < 3; ++c)
            for (std::uint32_t left = pack.used; left; left &= left - 1) {
                const float at = pack.corner[c][axis][std::countr_zero(left)];
                pack.low[axis] = std::min(pack.low[axis], at);
                pack.high[axis] = std::max(pack.high[axis], at);
            }
}

}  // namespace

OccluderPack::OccluderPack() {
    for (auto& axes : corner)
        for (auto& lanes : axes) std::fill(lanes, lanes + width, std::numeric_limits<float>::quiet_NaN());
    std::fill(id, id + width, 0U);
    refit(*this);
}

void PackedTriangles::add(std::uint8_t cell, std::uint8_t block, const std::array<Vec3, 3>& corner,
                          bool boundary, std::uint32_t id) {
    const std::uint64_t flag = std::uint64_t{1} << block;
    OccluderPack* home = nullptr;
    for (OccluderPack& pack : packs_) {
        if (pack.used == all_lanes) continue;
        if ((pack.blocks & flag) != 0) {
            home = &pack;
            break;
        }
        if (!home && std::popcount(pack.used) <= tuning::occluders::shared_fill) home = &pack;
    }
    if (!home) home = &packs_.emplace_back();
    const auto lane = static_cast<std::size_t>(std::countr_one(home->used));
    const std::uint32_t bit = std::uint32_t{1} << lane;
    home->used |= bit;
    home->boundary = boundary ? home->boundary | bit : home->boundary & ~bit;
    home->blocks |= flag;
    home->cell[lane] = cell;
    home->id[lane] = id;
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto k = static_cast<Eigen::Index>(axis);
            const auto at = static_cast<float>(corner[c][k] - centre_[k]);
            home->corner[c][axis][lane] = at;
            home->low[axis] = std::min(home->low[axis], at);
            home->high[axis] = std::max(home->high[axis], at);
            extent_ = std::max(extent_, std::abs(at));
        }
}

void PackedTriangles::remove(std::uint8_t cell) {
    for (OccluderPack& pack : packs_) {
        std::uint32_t gone = 0;
        for (std::uint32_t left = pack.used; left; left &= left - 1) {
            const auto lane = static_cast<std::size_t>(std::countr_zero(left));
            if (pack.cell[lane] != cell) continue;
            gone |= std::uint32_t{1} << lane;
            for (auto& axes : pack.corner)
                for (auto& lanes : axes) lanes[lane] = std::numeric_limits<float>::quiet_NaN();
        }
        if (gone == 0) continue;
        pack.used &= ~gone;
        if (pack.used == 0) pack.blocks = 0;
        refit(pack);
    }
    std::erase_if(packs_, [](const OccluderPack& pack) { return pack.used == 0; });
}

}  // namespace splitcubes::geometry
