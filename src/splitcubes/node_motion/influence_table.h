// Table of the affine maps of phyxels, laid out for SIMD code.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/math/types.h>

#include <cstddef>
#include <vector>

namespace splitcubes::body {

/// Influences: each has a position at rest, a reach, and two affine maps of the points within its reach, now
/// and a step ago. Single precision, structure of arrays.
class InfluenceTable {
  public:
    /// Offset off + matrix p of a point p, relative to a map that the user of the table has subtracted.
    struct State {
        Vec3 off = Vec3::Zero();     // m, world
        Mat3 matrix = Mat3::Zero();  // d world / d rest
    };
    /// A cube of rest space; m.
    struct Cube {
        Vec3f centre = Vec3f::Zero();
        float half = 0;  // of its side; 0: a point
    };

    std::size_t size() const { return size_; }
    /// New entries reach nothing until they are set; shrinking keeps the first ones.
    void resize(std::size_t count);
    /// position: m, rest space; squared_reach: m^2, negative: reaches nothing.
    void set(std::size_t i, const Vec3& position, double squared_reach, const State& now,
             const State& before);

    /// Appends the entries begin to end - 1 of `from` that reach a cube. Positions, and the points that the
    /// maps take, are relative to the cube's centre in this table.
    void append_from(const InfluenceTable& from, std::size_t begin, std::size_t end, const Cube& cube);
    /// Replaces the table by the entries of `from` that reach a cube.
    void assign_from(const InfluenceTable& from, const Cube& cube);

    /// Subtracts the mean matrix of the current states from the matrices of both states and returns it.
    /// Bit-identical for every instruction set.
    Mat3 subtract_mean();
    /// Returns the bounds, m, of the cube's points under the maps of the entries that reach it, without a
    /// margin for rounding.
    geometry::Box box_of(const Cube& cube) const;

  private:
    // Lists of numbers: position, squared reach, and per state the offset and the matrix by columns.
    static constexpr std::size_t position_list = 0, square = 3, state_size = 12, first_state = 4;
    static constexpr std::size_t fields = first_state + 2 * state_size;
    // Entries that are read at once at most; as many padding entries, which reach nothing, follow the last.
    static constexpr std::size_t width = 16;

    void reserve(std::size_t count);
    float* field(std::size_t f) { return numbers_.data() + f * stride_; }
    const float* field(std::size_t f) const { return numbers_.data() + f * stride_; }

    std::size_t size_ = 0, stride_ = 0;
    std::vector<float> numbers_;  // list by list
};

}  // namespace splitcubes::body
