// Finds the grid edges that blades may have crossed while the body moved.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/box.h>
#include <splitcubes/node_motion/node_hulls.h>
#include <splitcubes/node_motion/swept_boxes.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/splitting/node_grid.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Bounds on the positions of grid nodes, now and a step ago, from the phyxels alone, without kernels of the
/// nodes. A node's position is a convex combination of the positions to which its phyxels' affine maps move
/// it. For the nodes of a brick these maps are nearly equal: one affine map plus an offset within a box,
/// taken over the phyxels that can reach the brick and over both states. The body's mean map with wide boxes
/// selects the bricks that are bounded so closely; in these, blocks of eight nodes and then single nodes are
/// bounded by the phyxels in their own reach.
///
/// The bounds hold for every kernel that a node can have. So an edge that is away from the blade at the end
/// of an interval is away from it at the start of the next one, even if its kernel has changed in between.
class MovingBricks {
  public:
    struct State {
        const splitting::NodeGrid& grid;
        const meshless::Phyxels& phyxels;
        std::span<const Mat3> previous_deformation;
        double margin;  // m, by which a node may lie outside the support of a phyxel that influences it
    };
    /// Returns the uncut edges between inside nodes that may have met one of the swept boxes, ordered by
    /// brick, block of eight nodes, node and axis.
    std::vector<splitting::GridEdge> edges_near(const State& state, const SweptBoxes& swept,
                                                const Parallel& parallel);

  private:
    /// Affine map: rest point X goes to jacobian X + shift.
    struct Map {
        Mat3 jacobian = Mat3::Identity();
        Vec3 shift = Vec3::Zero();  // m
    };
    /// Sum of the maps of phyxels.
    struct MapSum {
        Mat3 jacobian = Mat3::Zero();
        Vec3 position = Vec3::Zero(), rest = Vec3::Zero();  // m
        double count = 0;

        MapSum& operator+=(const MapSum& other);
        Map mean() const;
    };
    /// Bound of the nodes and edges of a brick: the map plus an offset within the box.
    struct Bound {
        Map map;
        geometry::Box off;  // m, world
    };
    /// Buffers for a chunk of bricks; kept, because they are large.
    struct Scratch {
        std::vector<std::uint32_t> boxes;
        NodeHulls hulls;
    };
    static MapSum sum_of(const State& state, std::span<const std::uint32_t> phyxels);

    void sort_phyxels(const State& state);
    int bricks_around(const State& state) const;
    void find_boxes(const State& state, const Parallel& parallel);
    void spread_boxes(const splitting::BrickLayout& layout, int around, int axis, const Parallel& parallel);
    void choose_bricks(const State& state, const SweptBoxes& swept, const Parallel& parallel);
    void list_influences(const State& state, const Parallel& parallel);
    void start_hulls(const State& state, std::uint32_t brick, NodeHulls& hulls) const;
    double position_error(const State& state) const;
    void add_edges(const State& state, std::uint32_t brick, const SweptBoxes& swept, Scratch& scratch,
                   std::vector<splitting::GridEdge>& out) const;
    void add_block_edges(const State& state, std::uint32_t brick, int block, const Bound& bound, bool closely,
                         const SweptBoxes& swept, Scratch& scratch,
                         std::vector<splitting::GridEdge>& out) const;

    std::vector<std::uint32_t> begin_;       // per brick, first entry of phyxels_; one more at the end
    std::vector<std::uint32_t> phyxels_;     // by brick
    Map mean_;                               // of all phyxels, now
    std::vector<geometry::Box> phyxel_box_;  // per phyxel, m: offsets of nodes in reach from mean_
    std::vector<geometry::Box> boxes_;       // per brick, m: the same for its phyxels
    std::vector<geometry::Box> wider_;       // scratch
    std::vector<std::uint8_t> meets_;        // scratch, per brick
    std::vector<std::uint32_t> chosen_;      // bricks to bound closely, ascending
    InfluenceTable influences_;              // per entry of phyxels_, set if its brick can reach chosen ones;
                                             // positions relative to the grid's origin, maps to mean_
    std::vector<std::uint8_t> listed_;       // per brick: whether its phyxels are in influences_
    std::vector<std::vector<splitting::GridEdge>> edges_;  // scratch, per chunk of chosen bricks
    std::vector<Scratch> scratch_;                         // the same
    std::size_t sorted_ = 0;                               // phyxels in phyxels_
    double reach_ = 0;                                     // m, largest reach of a phyxel
};

}  // namespace splitcubes::body
