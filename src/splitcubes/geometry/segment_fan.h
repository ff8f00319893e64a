// Visibility tests from one point.
#pragma once

#include <splitcubes/geometry/occluder_grid.h>

#include <array>

namespace splitcubes::geometry {

/// Tests segments from one point to others within reach. The results are those of
/// OccluderGrid::segment_blocked; segments in an octant without triangles cost almost nothing.
/// Valid until the next set_cell.
class SegmentFan {
  public:
    /// reach: m, largest distance to a target point along any axis.
    SegmentFan(const OccluderGrid& occluders, const Vec3& from, double reach)
        : occluders_(occluders), from_(from), reach_(reach) {}

    bool blocked(const Vec3& to) {
        unsigned octant = 0;
        for (int axis = 0; axis < 3; ++axis) octant |= unsigned{to[axis] > from_[axis]} << axis;
        if (octants_[octant] == Octant::unknown)
            octants_[octant] = is_clear(octant) ? Octant::clear : Octant::occupied;
        return octants_[octant] == Octant::occupied && occluders_.segment_blocked(from_, to);
    }

  private:
    enum class Octant : unsigned char { unknown, clear, occupied };
    bool is_clear(unsigned octant) const {
        Box box{from_, from_};
        for (int axis = 0; axis < 3; ++axis)
            (octant >> axis & 1U ? box.max : box.min)[axis] += octant >> axis & 1U ? reach_ : -reach_;
        return occluders_.is_clear(box);
    }

    const OccluderGrid& occluders_;
    Vec3 from_;
    double reach_;
    std::array<Octant, 8> octants_{};
};

}  // namespace splitcubes::geometry
