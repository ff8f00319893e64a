// Which grid edges may have been where, as the body moves.
#pragma once

#include <splitcubes/body/node_hulls.h>
#include <splitcubes/body/swept_boxes.h>
#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/box.h>
#include <splitcubes/meshless/phyxels.h>
#include <splitcubes/splitting/node_grid.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Bounds on where grid nodes are, now and a step ago, from the phyxels alone: no node needs
/// a kernel for it. A node's place is a convex combination of where its phyxels would carry
/// it. Those of a brick of nodes carry it nearly alike: as one affine map, and off by no more
/// than a box, which is taken over the phyxels that can reach the brick and over both states.
/// The body's mean map and wide boxes choose the bricks that are looked at so closely; in those
/// that are left, blocks of eight nodes and then single nodes are bounded by the phyxels in their own reach.
///
/// The bounds hold for whatever of the phyxels a node's kernel is made: an edge that they
/// keep away from the blade's place at the end of an interval is away from it at the start of
/// the next one also where its kernel has changed in between.
class MovingBricks {
  public:
    struct State {
        const splitting::NodeGrid& grid;
        const meshless::Phyxels& phyxels;
        std::span<const Mat3> previous_deformation;
        double margin;  // m, by how much a node may lie out of a phyxel's support that carries it
    };
    /// The uncut edges between inside nodes that may have met one of the swept boxes, brick
    /// by brick, in a brick by block of eight nodes, then by node and axis.
    std::vector<splitting::GridEdge> edges_near(const State& state, const SweptBoxes& swept,
                                                const Parallel& parallel);

  private:
    /// Rest point X goes to jacobian X + shift.
    struct Map {
        Mat3 jacobian = Mat3::Identity();
        Vec3 shift = Vec3::Zero();  // m
    };
    /// Of the maps of phyxels, and how many they are.
    struct MapSum {
        Mat3 jacobian = Mat3::Zero();
        Vec3 position = Vec3::Zero(), rest = Vec3::Zero();  // m
        double count = 0;

        MapSum& operator+=(const MapSum& other);
        Map mean() const;
    };
    /// The nodes and edges of one brick: by the map, off by what lies in the box.
    struct Bound {
        Map map;
        geometry::Box off;  // m, world
    };
    /// What a chunk of bricks is worked on with; kept, as it is large.
    struct Scratch {
        std::vector<std::uint32_t> boxes;
        NodeHulls hulls;
    };
    static MapSum sum_of(const State& state, std::span<const std::uint32_t> numbers);

    void sort_phyxels(const State& state);
    int bricks_around(const State& state) const;
    void take_boxes(const State& state, const Parallel& parallel);
    void spread_boxes(const splitting::BrickLayout& layout, int around, int axis, const Parallel& parallel);
    void choose_bricks(const State& state, const SweptBoxes& swept, const Parallel& parallel);
    void list_influences(const State& state, const Parallel& parallel);
    void start_hulls(const State& state, std::uint32_t brick, NodeHulls& hulls) const;
    double place_error(const State& state) const;
    void add_edges(const State& state, std::uint32_t brick, const SweptBoxes& swept, Scratch& scratch,
                   std::vector<splitting::GridEdge>& out) const;
    void add_block_edges(const State& state, std::uint32_t brick, int block, const Bound& bound, bool closely,
                         const SweptBoxes& swept, Scratch& scratch,
                         std::vector<splitting::GridEdge>& out) const;

    std::vector<std::uint32_t> begin_;       // per brick, first entry of phyxels_; one more at the end
    std::vector<std::uint32_t> phyxels_;     // by brick
    Map mean_;                               // of all phyxels, now
    std::vector<geometry::Box> phyxel_box_;  // per phyxel: how far off mean_ it carries a node
    std::vector<geometry::Box> boxes_;       // per brick: how far off mean_ its phyxels carry a node
    std::vector<geometry::Box> wider_;       // scratch
    std::vector<std::uint8_t> meets_;        // scratch, per brick
    std::vector<std::uint32_t> chosen_;      // bricks to look at closely, ascending
    InfluenceTable influences_;              // as phyxels_, of the bricks whose phyxels reach these; places
                                             // from the grid's origin, by mean_
    std::vector<std::uint8_t> listed_;       // per brick: whether its phyxels are in influences_
    std::vector<std::vector<splitting::GridEdge>> edges_;  // scratch, per chunk of these
    std::vector<Scratch> scratch_;                         // the same
    std::size_t sorted_ = 0;                               // phyxels that are in phyxels_
    double reach_ = 0;                                     // m, of the phyxel that reaches farthest
};

}  // namespace splitcubes::body
