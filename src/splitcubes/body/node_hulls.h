// Bounds of single grid nodes, as the phyxels move.
#pragma once

#include <splitcubes/body/influence_table.h>

#include <array>
#include <cstdint>

namespace splitcubes::body {

/// Where the nodes of a cube of four grid cells a side can be, off by how much from an affine map
/// of rest space: a box over what the phyxels in reach make of a node, now and a step ago.
/// Single precision, widened by more than its rounding; the map takes the large numbers out.
///
/// Made for one cube after the other: start, add the phyxels, settle, ask.
class NodeHulls {
  public:
    static constexpr int side = 4;        // cells of the cube
    static constexpr int block_side = 2;  // cells of a block, of which the cube has eight
    static constexpr int block_count = 8;

    /// What a phyxel makes of the cube beyond the map; off: at the cube's centre.
    using State = InfluenceTable::State;

    /// cell: m; place_error: m, by how much the places of what is added may be wrong.
    void start(double cell, double place_error = 0);
    /// from_centre: m, of the phyxel from the cube's, rest space; reach: m, how far from there it
    /// carries nodes.
    void add(const Vec3& from_centre, double reach, const State& now, const State& before);
    /// Those of a table between two entries that reach the cube. centre: m, of the cube, as the table counts.
    void add_from(const InfluenceTable& table, std::size_t begin, std::size_t end, const Vec3f& centre);
    bool empty() const { return influences_.size() == 0; }
    /// When all are in. False where something is too large for single precision: only box_of_cube may
    /// be asked then.
    bool settle();

    /// To be added to the map's matrix: what follows is off by from a map that turns about the cube's centre.
    const Mat3& mean() const { return mean_; }
    /// Of all nodes of the cube, its upper faces included; m, world.
    const geometry::Box& box_of_cube() const { return whole_; }
    /// The block, numbered x fastest, that is asked about from now on.
    void choose_block(int block);
    /// Of all nodes in the chosen block, its upper faces included; m, world. Empty: none is reached.
    geometry::Box box_of_block() const;
    /// Of a node of the chosen block, 0..4 along each axis from the cube's low corner.
    const geometry::Box& box_of(const Vec3i& node);

  private:
    static constexpr int nodes_a_side = side + 1;
    geometry::Box widened(const geometry::Box& box) const { return box.empty() ? box : box.grown(slack_); }

    InfluenceTable influences_, near_;    // all; that reach the chosen block
    float cell_ = 0;                      // m
    double place_error_ = 0, slack_ = 0;  // m
    Mat3 mean_ = Mat3::Zero();
    geometry::Box whole_;
    bool is_near_known_ = false;
    InfluenceTable::Cube block_;  // the chosen one
    std::array<geometry::Box, static_cast<std::size_t>(nodes_a_side* nodes_a_side* nodes_a_side)> box_;
    std::array<bool, static_cast<std::size_t>(nodes_a_side* nodes_a_side* nodes_a_side)> known_{};
};

}  // namespace splitcubes::body
