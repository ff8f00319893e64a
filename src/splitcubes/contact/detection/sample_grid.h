// Uniform grid that finds samples which face each other.
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

/// Dot product of normals below which surfaces face each other; an edge or a corner faces a plane.
inline constexpr double facing_cosine = -0.4;

/// Uniform grid over points with normals. It keeps only points that another point within reach may face:
/// normals are binned into 54 solid angles, and each cell knows the bins (a bit mask) and normal bounds (a
/// box) around it. An uncut solid keeps almost no points. Points are filtered in single precision, up to
/// sixteen at a time, and confirmed in double. Memory is reused from build to build. Queries may run on
/// several threads at once.
///
/// Kept points are addressed by entry, in order of the cells, so that neighbours in space are neighbours in
/// memory.
class SampleGrid {
  public:
    /// Motion of a point within a step, m: predicted displacement, possible further displacement, and
    /// how much it adds to the minimum reach.
    struct Motion {
        Vec3 displacement = Vec3::Zero(), drift = Vec3::Zero();
        double extra_reach = 0;
    };
    /// m: two points are within reach of each other if their distance is less than `min` plus the
    /// `extra_reach` of both, and less than `max`. 0 < min <= max <= 3 min.
    struct Reach {
        double min = 1, max = 1;
        double cosine = facing_cosine;  // dot product of normals below which two points face each other
    };
    /// Gets the indices of the points that are kept.
    using RefineCallback = std::function<void(std::span<const std::uint32_t> kept)>;

    /// Rebuilds the grid. points: m; normals: unit; motions: motion within the step; owners: id of the owner
    /// of each point. All are copied. The points may be approximate at first, and their motion only an upper
    /// bound of `extra_reach`: `refine` gets the indices of the kept points and may update them and their
    /// motion in the caller's arrays. A pair that comes within reach only by such an update may be missed.
    void build(std::span<const Vec3> points, std::span<const Vec3> normals, std::span<const Motion> motions,
               std::span<const std::uint16_t> owners, const Reach& reach, const Parallel& parallel,
               const RefineCallback& refine = {});

    /// Returns the number of kept points. A point that is not kept faces no point within its reach.
    std::size_t size() const { return index_.size(); }
    /// Index in the arrays of build, position (m) and normal of an entry.
    std::uint32_t index(std::size_t entry) const { return index_[entry]; }
    const Vec3& point(std::size_t entry) const { return sorted_[entry].point; }
    const Vec3& normal(std::size_t entry) const { return sorted_[entry].normal; }

    /// Returns false only if no point within reach of the entry faces it.
    bool may_face(std::size_t entry) const {
        return around_[sorted_[entry].cell].may_face(normal(entry), reach_.cosine);
    }

    /// Returns true only if all points within reach of the entry that may face any point have its owner.
    bool is_among_own(std::size_t entry) const {
        const Extent& around = around_[sorted_[entry].cell];
        return around.first_owner == around.last_owner;
    }

    /// A point that faces the queried one.
    struct FacingPoint {
        std::uint32_t entry;
        double squared_distance;  // m^2
        double cosine;            // dot product of the normals
        double height;            // m, height of the queried point above the plane through this one
        double end_height;        // m, the same after the step; drift counts only if it reduces it
    };
    /// Finds the points that face the entry `of`, are within its reach and nearer to it than `radius` (m), in
    /// order of their entries, and replaces `out`. Returns none if the entry will be farther than `height`
    /// (m) above the planes through all of them. scratch: a buffer of the calling thread.
    void find_facing(std::size_t of, double radius, double height, std::vector<std::uint32_t>& scratch,
                     std::vector<FacingPoint>& out) const;

  private:
    static constexpr std::size_t bin_count = 54;  // 3 x 3 on each side of a cube

    struct Point {
        Vec3 point, normal;
        Motion motion;
        std::uint32_t cell;
        std::uint16_t owner;
    };

    /// Bounds of the normals' coordinates and of the owners of some points.
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
        /// Returns whether a normal within the bounds faces this one.
        bool may_face(const Vec3& normal, double cosine) const {
            double min_dot = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const double n = normal[static_cast<Eigen::Index>(k)];
                min_dot += n * static_cast<double>(n > 0 ? low[k] : high[k]);
            }
            return !(min_dot > cosine + 1e-6);
        }
    };
    using FacingBins = std::array<std::uint64_t, bin_count>;
    static FacingBins find_facing_bins(double cosine);
    const FacingBins& facing_bins();
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
    void find_extra_reach(std::span<const Motion> motions, const Parallel& parallel);
    /// Sets each cell to the result of `join` over all cells up to `rings` away.
    template <class Value, class Join>
    void spread(int rings, std::vector<Value>& values, std::vector<Value>& spare, const Parallel& parallel,
                const Join& join) const;
    bool is_wide(std::size_t cell) const { return any_wide_ && extra_reach_[cell] > 0; }
    /// Returns the maximum extra reach (m) of points that are reached from the cell.
    double max_extra_reach(std::size_t cell) const {
        return is_wide(cell) ? extra_reach_[cell] : 0.5 * (size_ - reach_.min);
    }
    void choose_kept(std::span<const Vec3> points, const Parallel& parallel, const RefineCallback& refine);
    void sort_points(std::span<const Vec3> points, std::span<const Vec3> normals,
                     std::span<const Motion> motions, std::span<const std::uint16_t> owners,
                     const Parallel& parallel);
    void find_extents(const Parallel& parallel);
    Extent extent_around(std::size_t cell) const;

    Vec3 origin_ = Vec3::Zero();  // m, low corner
    double size_ = 1;             // m, of a cell
    Reach reach_;
    /// Bins that face each other below a dot product of normals.
    struct FacingTable {
        double cosine = 2;  // above 1: none
        FacingBins bins{};
    };
    FacingTable facing_;
    bool any_wide_ = false;  // whether any cell is wide: some extra reach exceeds what the cell size covers
    int rings_ = 1;          // cells that are reached from a wide one, in each direction
    double cells_per_metre_ = 1;
    double extent_ = 0;      // m, maximum extent of the points along an axis
    double max_motion_ = 0;  // m, maximum motion of the kept points along an axis
    Vec3i count_ = Vec3i::Ones();
    // Per point.
    std::vector<std::uint32_t> cell_;
    std::vector<std::uint8_t> bin_;
    std::vector<std::uint32_t> kept_;  // indices, ascending
    // Per cell: bit masks of the bins of all normals within reach of it.
    std::vector<std::uint64_t> bins_around_, wide_bins_, spare_bins_;
    // m, per cell, if any is wide: maximum extra reach of points that are reached from it; 0 if all are slow.
    std::vector<float> extra_reach_, spare_extra_reach_;
    std::vector<std::uint32_t> begin_, next_;  // per cell: its first entry; plus one at the end
    std::vector<std::uint32_t> index_;         // per entry: index in the arrays of build
    std::vector<Point> sorted_;                // per entry
    // Per entry, padded by a vector: position from the origin, m; normal; displacement, additional
    // displacement and extra reach, m.
    std::array<std::vector<float>, 13> lanes_;
    // Per nonempty cell: bounds of its own kept points; and of all within reach of it.
    std::vector<Extent> own_, around_;
};

}  // namespace splitcubes::body
