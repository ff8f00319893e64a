// Samples of skins by place and by the way that they face.
#pragma once

#include <splitcubes/math/types.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Normals' product below which skins face each other: an edge or a corner on a face does.
inline constexpr double facing_cosine = -0.4;

/// A uniform grid over points with normals, whose memory is kept from build to build. It
/// knows for each point whether anything around it can face it at all: directions are sorted
/// into 54 solid angles, and those within some cells of a point are a mask. Where a solid is not cut, next to
/// no point is ever looked around. Queries may run on several threads at once.
class SkinGrid {
  public:
    /// The largest radius that may be asked for, in the reach of build.
    static constexpr int most_rings = 3;

    /// points: m; normals: unit; reach: m, > 0, of most queries; farthest: m, the largest radius that is
    /// asked for, at most most_rings times the reach. Spans must stay.
    void build(std::span<const Vec3> points, std::span<const Vec3> normals, double reach, double farthest);

    /// False only where no point within `radius` of this one (m, as of visit_facing) faces it.
    bool may_face(std::size_t point, double radius) const {
        const auto ring = static_cast<std::size_t>(std::ceil(radius / size_));
        return (around_[ring][cell_[point]] & facing_bins()[bin_[point]]) != 0;
    }

    /// Calls use(index) for each point that faces point number `of` and is nearer to it than
    /// `radius` (m, at most the farthest), in a fixed order.
    template <class Use>
    void visit_facing(std::size_t of, double radius, const Use& use) const;

  private:
    static constexpr std::size_t bin_count = 54;  // 3 x 3 on each side of a cube
    static const std::array<std::uint64_t, bin_count>& facing_bins();
    static std::uint8_t bin_of(const Vec3& normal);
    Vec3i cell_at(const Vec3& point) const;
    std::size_t cell_index(int x, int y, int z) const {
        return (static_cast<std::size_t>(z) * static_cast<std::size_t>(count_.y()) +
                static_cast<std::size_t>(y)) *
                   static_cast<std::size_t>(count_.x()) +
               static_cast<std::size_t>(x);
    }
    void lay_out(std::span<const Vec3> points, double reach);
    void spread_bins(std::span<const std::uint64_t> from, std::vector<std::uint64_t>& to);

    struct Entry {
        Vec3 point, normal;
        std::uint32_t index;
    };
    Vec3 origin_ = Vec3::Zero();  // m, low corner
    double size_ = 1;             // m, of a cell
    Vec3i count_ = Vec3i::Ones();
    std::vector<std::uint32_t> cell_;          // per point
    std::vector<std::uint8_t> bin_;            // per point
    std::vector<std::uint32_t> begin_, next_;  // per cell, first of its entries; one more at the end
    std::vector<Entry> entries_;               // cell by cell
    // Per cell: directions of the points within so many cells of it along each axis.
    std::array<std::vector<std::uint64_t>, most_rings + 1> around_;
    std::vector<std::uint64_t> spare_;
    std::span<const Vec3> points_, normals_;
};

template <class Use>
void SkinGrid::visit_facing(std::size_t of, double radius, const Use& use) const {
    const Vec3 point = points_[of], normal = normals_[of];
    const Vec3i low = cell_at(point - Vec3::Constant(radius)), high = cell_at(point + Vec3::Constant(radius));
    const double limit = radius * radius;
    for (int z = low.z(); z <= high.z(); ++z)
        for (int y = low.y(); y <= high.y(); ++y) {
            const std::uint32_t end = begin_[cell_index(high.x(), y, z) + 1];
            for (std::uint32_t k = begin_[cell_index(low.x(), y, z)]; k < end; ++k)
                if ((entries_[k].point - point).squaredNorm() < limit &&
                    normal.dot(entries_[k].normal) < facing_cosine)
                    use(entries_[k].index);
        }
}

}  // namespace splitcubes::body
