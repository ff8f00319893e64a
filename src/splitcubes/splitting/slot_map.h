// Sparse map from grid positions to slots of packed arrays.
#pragma once

#include <splitcubes/math/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace splitcubes::splitting {

/// Side of a brick of 4^3 grid positions: small enough that a surface fills a good part of the bricks that it
/// touches, and one 64-bit word has a bit for each position.
inline constexpr int brick_side = 4;
inline constexpr int nodes_per_brick = 64;

/// Shape of a grid in bricks.
struct BrickLayout {
    Vec3i brick_count = Vec3i::Zero();

    BrickLayout() = default;
    explicit BrickLayout(const Vec3i& position_count)
        : brick_count((position_count + Vec3i::Constant(brick_side - 1)) / brick_side) {}
    std::size_t total() const {
        return static_cast<std::size_t>(brick_count[0]) * static_cast<std::size_t>(brick_count[1]) *
               static_cast<std::size_t>(brick_count[2]);
    }
    std::size_t brick_of(const Vec3i& position) const {
        return static_cast<std::size_t>(position[0] >> 2) +
               static_cast<std::size_t>(brick_count[0]) *
                   (static_cast<std::size_t>(position[1] >> 2) +
                    static_cast<std::size_t>(brick_count[1]) * static_cast<std::size_t>(position[2] >> 2));
    }
    /// Returns the lowest grid position of a brick.
    Vec3i base(std::size_t brick) const {
        const auto nx = static_cast<std::size_t>(brick_count[0]),
                   ny = static_cast<std::size_t>(brick_count[1]);
        return brick_side * Vec3i(static_cast<int>(brick % nx), static_cast<int>(brick / nx % ny),
                                  static_cast<int>(brick / (nx * ny)));
    }
    static unsigned local(const Vec3i& position) {
        return static_cast<unsigned>((position[0] & 3) | (position[1] & 3) << 2 | (position[2] & 3) << 4);
    }
    static Vec3i local_node(unsigned local) {
        return {static_cast<int>(local & 3), static_cast<int>(local >> 2 & 3), static_cast<int>(local >> 4)};
    }
};

/// `Channels` slots (-1: none) per grid position, stored for touched bricks only: 4 bytes per brick of the
/// grid, 256 * Channels bytes per touched brick.
template <int Channels>
class SlotMap {
  public:
    SlotMap() = default;
    explicit SlotMap(const BrickLayout& layout) : layout_(layout), block_(layout.total(), -1) {}

    std::int32_t get(const Vec3i& position, int channel) const {
        const std::int32_t block = block_[layout_.brick_of(position)];
        return block < 0 ? -1 : blocks_[static_cast<std::size_t>(block)][index(position, channel)];
    }
    std::int32_t get_at(std::size_t brick, unsigned local, int channel) const {
        const std::int32_t block = block_[brick];
        return block < 0 ? -1
                         : blocks_[static_cast<std::size_t>(block)]
                                  [static_cast<std::size_t>(channel) * nodes_per_brick + local];
    }
    void set(const Vec3i& position, int channel, std::int32_t slot) {
        std::int32_t& block = block_[layout_.brick_of(position)];
        if (block < 0) {
            block = static_cast<std::int32_t>(blocks_.size());
            blocks_.emplace_back().fill(-1);
        }
        blocks_[static_cast<std::size_t>(block)][index(position, channel)] = slot;
    }
    std::size_t bytes() const {
        return block_.size() * sizeof(std::int32_t) + blocks_.size() * sizeof(Block);
    }

  private:
    using Block = std::array<std::int32_t, static_cast<std::size_t>(Channels) * nodes_per_brick>;
    static std::size_t index(const Vec3i& position, int channel) {
        return static_cast<std::size_t>(channel) * nodes_per_brick + BrickLayout::local(position);
    }
    BrickLayout layout_;
    std::vector<std::int32_t> block_;  // per brick of the grid
    std::vector<Block> blocks_;
};

}  // namespace splitcubes::splitting
