// Which bricks of grid nodes may have been where, as the body moves.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/box.h>
#include <splitcubes/meshless/phyxels.h>
#include <splitcubes/splitting/node_grid.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// World boxes of bricks, now and a step ago. A node's place is a convex combination of
/// where its phyxels would carry it, so the union of these places holds it. Coarse boxes, of
/// whatever a brick's phyxels may carry, choose the bricks to look at; the boxes of those
/// are of what each phyxel within reach makes of the brick itself.
class MovingBricks {
  public:
    struct State {
        const splitting::NodeGrid& grid;
        const meshless::Phyxels& phyxels;
        std::span<const Mat3> previous_deformation;
        double reach;  // m, how far from a phyxel's rest position a node may lie that it carries
    };
    /// The bricks with inside nodes that may meet the box (world), ascending.
    std::vector<std::uint32_t> meeting(const State& state, const geometry::Box& box,
                                       const Parallel& parallel);

  private:
    void sort_phyxels(const State& state);
    void take_boxes(const State& state, const Parallel& parallel);
    void spread_boxes(const splitting::BrickLayout& layout, int around, int axis, const Parallel& parallel);
    geometry::Box exact_box(const State& state, std::uint32_t brick) const;

    std::vector<std::uint32_t> begin_;     // per brick, first entry of phyxels_; one more at the end
    std::vector<std::uint32_t> phyxels_;   // by brick
    std::vector<geometry::Box> boxes_;     // per brick, world
    std::vector<geometry::Box> narrower_;  // scratch
    std::vector<std::uint8_t> meets_;      // scratch, per brick
    std::size_t sorted_ = 0;               // phyxels that are in phyxels_
};

}  // namespace splitcubes::body
