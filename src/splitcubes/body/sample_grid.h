// Samples of skins by place and by the way that they face.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/math/types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Normals' product below which skins face each other: an edge or a corner on a face does.
inline constexpr double facing_cosine = -0.4;

/// A uniform grid over points with normals, whose memory is kept from build to build. Of them it keeps those
/// that another one around may face at all: normals are sorted into 54 solid angles, and those around a cell
/// are a mask and a box. Where a solid is not cut, next to nothing is kept. Points are looked through in
/// single precision, sixteen at a time where the machine can, and decided in double. Queries may run on
/// several threads at once.
///
/// Points go by their places in the grid's own order, cell by cell: what is near in space is then near in
/// memory.
class SampleGrid {
  public:
    /// m, in a step: that a point surely goes, and what it may go beyond that; and how much farther than the
    /// least reach others have to be known for it.
    struct Way {
        Vec3 sure = Vec3::Zero(), more = Vec3::Zero();
        double farther = 0;
    };
    /// m: two points are within reach of each other whose distance is less than `least` and what both ways
    /// add to it, and less than `most`. 0 < least <= most <= 3 least.
    struct Reach {
        double least = 1, most = 1;
    };
    /// Called with the numbers of the points that are kept.
    using Place = std::function<void(std::span<const std::uint32_t> kept)>;

    /// points: m; normals: unit; ways: of each within the step; owners: whose each is. All are copied. Points
    /// may be rough at first, and of their ways only a bound of `farther` be known: `place` is called with
    /// those that are kept, and may move them, and set their ways, in the caller's lists. One by which
    /// another one came within the reach less the two moves may be missed.
    void build(std::span<const Vec3> points, std::span<const Vec3> normals, std::span<const Way> ways,
               std::span<const std::uint16_t> owners, const Reach& reach, const Parallel& parallel,
               const Place& place = {});

    /// Of the points that are kept. What is not kept faces none within the reach.
    std::size_t size() const { return number_.size(); }
    /// Of the point at a place: its number in build's spans, itself (m), and its normal.
    std::uint32_t number(std::size_t place) const { return number_[place]; }
    const Vec3& point(std::size_t place) const { return sorted_[place].point; }
    const Vec3& normal(std::size_t place) const { return sorted_[place].normal; }

    /// False only where no point within the reach of the one at a place faces it.
    bool may_face(std::size_t place) const { return around_[sorted_[place].cell].may_face(normal(place)); }

    /// True only where all points within the reach of the one at a place are its owner's, of those that may
    /// face any.
    bool is_among_own(std::size_t place) const {
        const Extent& around = around_[sorted_[place].cell];
        return around.first_owner == around.last_owner;
    }

    /// A point that faces another one, which asks for it.
    struct Faced {
        std::uint32_t place;
        double square;  // m^2, of the distance
        double cosine;  // of the normals
        double along;   // m, of the asking one above the plane through this one
        double next;    // m, the same after both ways, and what these may be nearer by
    };
    /// The points that face the one at place `of`, are within its reach and nearer to it than `radius` (m),
    /// in order of their places; `out` is replaced. It may be left empty where that one will lie farther than
    /// `height` (m) above the planes through all of them. scratch: of the calling thread.
    void find_facing(std::size_t of, double radius, double height, std::vector<std::uint32_t>& scratch,
                     std::vector<Faced>& out) const;

  private:
    static constexpr std::size_t bin_count = 54;  // 3 x 3 on each side of a cube

    struct Point {
        Vec3 point, normal;
        Way way;
        std::uint32_t cell;
        std::uint16_t owner;
    };

    /// Of some points' normals' coordinates, and owners.
    struct Extent {
        std::array<float, 3> low{2, 2, 2}, high{-2, -2, -2};
        std::uint16_t first_owner = 0xffff, last_owner = 0;

        void add(const Extent& other) {
            for (std::size_t k = 0; k < 3; ++k) {
                low[k] = std::min(low[k], other.low[k]);
                high[k] = std::max(high[k], other.high[k]);
            }
            first_owner = std::min(first_owner, other.first_owner);
            last_owner = std::max(last_owner, other.last_owner);
        }
        /// Whether a normal within them faces this one.
        bool may_face(const Vec3& normal) const {
            double least = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const double n = normal[static_cast<Eigen::Index>(k)];
                least += n * static_cast<double>(n > 0 ? low[k] : high[k]);
            }
            return !(least > facing_cosine + 1e-6);
        }
    };
    static const std::array<std::uint64_t, bin_count>& facing_bins();
    static std::uint8_t bin_of(const Vec3& normal);
    Vec3i cell_at(const Vec3& point) const;
    std::size_t cell_index(int x, int y, int z) const {
        return (static_cast<std::size_t>(z) * static_cast<std::size_t>(count_.y()) +
                static_cast<std::size_t>(y)) *
                   static_cast<std::size_t>(count_.x()) +
               static_cast<std::size_t>(x);
    }
    void lay_out(std::span<const Vec3> points, const Reach& reach);
    void find_bins(std::span<const Vec3> points, std::span<const Vec3> normals, const Parallel& parallel);
    void find_bins_around(const Parallel& parallel);
    void find_farther(std::span<const Way> ways, const Parallel& parallel);
    /// To each cell what `join` makes of its value and those up to `rings` cells from it.
    template <class Value, class Join>
    void spread(int rings, std::vector<Value>& values, std::vector<Value>& spare, const Parallel& parallel,
                const Join& join) const;
    bool is_wide(std::size_t cell) const { return any_fast_ && farther_[cell] > 0; }
    /// m, what a point that is reached from the cell adds to the reach at most.
    double farther_of(std::size_t cell) const {
        return is_wide(cell) ? farther_[cell] : 0.5 * (size_ - reach_.least);
    }
    void choose_kept(std::span<const Vec3> points, const Parallel& parallel, const Place& place);
    void sort_points(std::span<const Vec3> points, std::span<const Vec3> normals, std::span<const Way> ways,
                     std::span<const std::uint16_t> owners, const Parallel& parallel);
    void find_extents(const Parallel& parallel);
    Extent extent_around(std::size_t cell) const;

    Vec3 origin_ = Vec3::Zero();  // m, low corner
    double size_ = 1;             // m, of a cell
    Reach reach_;
    bool any_fast_ = false;  // whether a cell is wide: some point adds more to the reach than cells allow for
    int rings_ = 1;          // cells around a wide one that are reached from it
    double cells_a_metre_ = 1;
    double extent_ = 0;    // m, of the points along an axis
    double most_way_ = 0;  // m, of those that are kept, along an axis
    Vec3i count_ = Vec3i::Ones();
    // Per point, by numbers.
    std::vector<std::uint32_t> cell_;
    std::vector<std::uint8_t> bin_;
    std::vector<std::uint32_t> kept_;  // numbers, ascending
    // Per cell: of the solid angles of the normals in it and in those that are reached from it.
    std::vector<std::uint64_t> bins_around_, wide_bins_, spare_bins_;
    // Per cell, where any is wide: m, what a point that is reached from it adds to the reach at most; 0 where
    // all are slow.
    std::vector<float> farther_, spare_farther_;
    std::vector<std::uint32_t> begin_, next_;  // per cell, first of its places; one more at the end
    std::vector<std::uint32_t> number_;        // per place
    std::vector<Point> sorted_;                // per place
    // Per place, with room for a vector more: m from the origin; of unit normals; m, of ways.
    std::array<std::vector<float>, 13> lanes_;
    // Per cell that has places: of the kept normals in it; and in those that are reached from it.
    std::vector<Extent> own_, around_;
};

}  // namespace splitcubes::body
