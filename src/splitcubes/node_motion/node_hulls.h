// Bounds of the positions of single grid nodes while the phyxels move.
#pragma once

#include <splitcubes/node_motion/influence_table.h>

#include <array>
#include <cstdint>

namespace splitcubes::body {

/// Bounds of the nodes of a cube of four grid cells per side, as offsets from an affine map of rest space:
/// the box of a node covers the maps of all phyxels in reach, now and a step ago. Single precision, enlarged
/// by more than the rounding error; the affine map removes the large values.
///
/// Used for one cube after another: start, add the phyxels, finish, query.
class NodeHulls {
  public:
    static constexpr int side = 4;        // cells of the cube
    static constexpr int block_side = 2;  // cells of a block, of which the cube has eight
    static constexpr int block_count = 8;

    /// Map of a phyxel relative to the affine map; off: at the cube's centre.
    using State = InfluenceTable::State;

    /// cell: m; position_error: m, largest error of the positions that are added.
    void start(double cell, double position_error = 0);
    /// Adds a phyxel. from_centre: m, its rest position relative to the cube's centre; reach: m, distance up
    /// to which it influences nodes.
    void add(const Vec3& from_centre, double reach, const State& now, const State& before);
    /// Adds the entries begin to end - 1 of a table that reach the cube. centre: m, of the cube, in the
    /// table's frame.
    void add_from(const InfluenceTable& table, std::size_t begin, std::size_t end, const Vec3f& centre);
    bool empty() const { return influences_.size() == 0; }
    /// Prepares queries after all phyxels were added. Returns false if values are too large for single
    /// precision; then only box_of_cube may be queried.
    bool finish();

    /// Mean matrix, to be added to the affine map's matrix with the cube's centre fixed: the following boxes
    /// are offsets from that map.
    const Mat3& mean() const { return mean_; }
    /// Bounds of all nodes of the cube, its upper faces included; m, world.
    const geometry::Box& box_of_cube() const { return cube_box_; }
    /// Selects the block (index with x fastest) for the queries that follow.
    void choose_block(int block);
    /// Bounds of all nodes of the chosen block, its upper faces included; m, world. Empty: no phyxel reaches
    /// it.
    geometry::Box box_of_block() const;
    /// Bounds of a node of the chosen block, m, world; node: 0..4 along each axis from the cube's low corner.
    const geometry::Box& box_of(const Vec3i& node);

  private:
    static constexpr int nodes_per_side = side + 1;
    geometry::Box widened(const geometry::Box& box) const { return box.empty() ? box : box.grown(slack_); }

    InfluenceTable influences_, near_;       // all; those that reach the chosen block
    float cell_ = 0;                         // m
    double position_error_ = 0, slack_ = 0;  // m
    Mat3 mean_ = Mat3::Zero();
    geometry::Box cube_box_;
    bool is_near_known_ = false;
    InfluenceTable::Cube block_;  // the chosen one
    std::array<geometry::Box, static_cast<std::size_t>(nodes_per_side* nodes_per_side* nodes_per_side)> box_;
    std::array<bool, static_cast<std::size_t>(nodes_per_side* nodes_per_side* nodes_per_side)> known_{};
};

}  // namespace splitcubes::body
