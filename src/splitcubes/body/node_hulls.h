// Bounds of single grid nodes, as the phyxels move.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/math/types.h>

#include <array>
#include <cstdint>
#include <vector>

namespace splitcubes::body {

/// Where the nodes of a cube of four grid cells a side can be, off by how much from an affine map
/// of rest space: a box over what the phyxels in reach make of a node, now and a step ago.
/// Single precision, widened by more than its rounding; the map takes the large numbers out.
///
/// Made for one cube after the other: start, add the phyxels, ask.
class NodeHulls {
  public:
    static constexpr int side = 4;        // cells of the cube
    static constexpr int block_side = 2;  // cells of a block, of which the cube has eight
    static constexpr int block_count = 8;

    /// What a phyxel makes of the cube beyond the map.
    struct State {
        Vec3 off = Vec3::Zero();     // m, world, at the cube's centre
        Mat3 matrix = Mat3::Zero();  // d world / d rest
    };
    /// cell: m; largest: m, by how much a phyxel can be off within the cube, along any axis.
    /// False where that is too large for single precision: nothing else may be asked then.
    bool start(double cell, double largest);
    /// from_centre: m, of the phyxel from the cube's, rest space; reach: m, how far from there it
    /// carries nodes.
    void add(const Vec3& from_centre, double reach, const State& now, const State& before);

    /// The block, numbered x fastest, that is asked about from now on.
    void choose_block(int block);
    /// Of all nodes in the chosen block, its upper faces included; m, world. Empty: none is reached.
    geometry::Box box_of_block() const;
    /// Of a node of the chosen block, 0..4 along each axis from the cube's low corner.
    const geometry::Box& box_of(const Vec3i& node);

  private:
    using Vec4f = Eigen::Vector4f;
    static constexpr int nodes_a_side = side + 1;
    struct Carrier {
        Vec4f from_centre;                    // m; last: 0
        std::array<Eigen::Matrix4f, 2> made;  // columns: of the matrix, then what is off
        float square;                         // of the reach, m^2
    };
    geometry::Box widened(const Vec4f& low, const Vec4f& high) const;
    std::size_t list_reaching(const Vec4f& at);

    std::vector<Carrier> carriers_;
    std::vector<std::uint32_t> near_;        // that reach the chosen block
    std::vector<float> x_, y_, z_, square_;  // of those: from_centre and square
    std::vector<float> room_;                // scratch of box_of
    std::vector<std::uint32_t> reaching_;    // the same
    float cell_ = 0;                         // m
    double slack_ = 0;                       // m
    Vec4f block_ = Vec4f::Zero();            // the chosen one's centre from the cube's, m
    std::array<geometry::Box, static_cast<std::size_t>(nodes_a_side* nodes_a_side* nodes_a_side)> box_;
    std::array<bool, static_cast<std::size_t>(nodes_a_side* nodes_a_side* nodes_a_side)> known_{};
};

}  // namespace splitcubes::body
