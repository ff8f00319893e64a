// What phyxels make of the space around them, side by side as vector code reads it.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/math/types.h>

#include <cstddef>
#include <vector>

namespace splitcubes::body {

/// Carriers: each has a place, reaches so far from it, and makes something of what it reaches, now
/// and a step ago. Single precision.
class InfluenceTable {
  public:
    /// A point p goes to off + matrix p, beyond a map that whoever fills the table leaves out.
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
    /// Those that are new reach nothing until they are set; of a smaller table the first are left.
    void resize(std::size_t count);
    /// place: m, rest space; square_of_reach: m^2, less than zero where nothing is reached.
    void set(std::size_t i, const Vec3& place, double square_of_reach, const State& now, const State& before);

    /// Appends those of `from` between two entries that reach a cube; places, and the points of which they
    /// make something, count from the cube's centre in this table.
    void append_from(const InfluenceTable& from, std::size_t begin, std::size_t end, const Cube& cube);
    /// Becomes those of `from` that reach a cube.
    void assign_from(const InfluenceTable& from, const Cube& cube);

    /// Takes the mean of the present states' matrices out of all of both states, and returns it. The
    /// same for every instruction set.
    Mat3 take_out_mean();
    /// Holds what the carriers that reach a cube make of it, m; not widened by what rounding may move.
    geometry::Box box_of(const Cube& cube) const;

  private:
    // Lists of numbers: of the place, the reach's square, and of each state what is off and the
    // matrix by columns.
    static constexpr std::size_t place = 0, square = 3, state_size = 12, first_state = 4;
    static constexpr std::size_t fields = first_state + 2 * state_size;
    // Entries are read so many at a time, and there are some that reach nothing behind the last.
    static constexpr std::size_t width = 16;

    void make_room(std::size_t count);
    float* field(std::size_t f) { return numbers_.data() + f * stride_; }
    const float* field(std::size_t f) const { return numbers_.data() + f * stride_; }

    std::size_t size_ = 0, stride_ = 0;
    std::vector<float> numbers_;  // list by list
};

}  // namespace splitcubes::body
