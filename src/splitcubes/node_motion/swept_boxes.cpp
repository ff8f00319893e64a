#include <splitcubes/node_motion/swept_boxes.h>

#include <algorithm>

namespace splitcubes::body {

namespace {

// Returns orthonormal axes as rows: along the segment, along the part of its motion normal to it, normal to
// both.
Mat3 axes_of(const geometry::MovingSegment& s) {
    const Vec3 along = (s.b0 - s.a0) + (s.b1 - s.a1);
    const double length = along.norm();
    const Vec3 u = length > 0 ? Vec3(along / length) : Vec3::UnitX();
    Vec3 motion = (s.a1 - s.a0) + (s.b1 - s.b0);
    motion -= motion.dot(u) * u;
    const double distance = motion.norm();
    // The direction of a motion that is tiny compared with the segment is only rounding.
    const Vec3 v = distance > 1e-9 * length ? Vec3(motion / distance) : u.unitOrthogonal();
    Mat3 axes;
    axes << u.transpose(), v.transpose(), u.cross(v).transpose();
    return axes;
}

}  // namespace

SweptBoxes::SweptBoxes(std::span<const cutting::SweptBlade> blades, double margin) {
    for (const cutting::SweptBlade& blade : blades)
        for (const geometry::MovingSegment& segment : blade.segments) {
            const Mat3 axes = axes_of(segment);
            geometry::Box along;
            for (const Vec3& point : {segment.a0, segment.b0, segment.a1, segment.b1})
                along.add(axes * point);
            boxes_.push_back({geometry::bounds_of(segment).grown(margin), axes, along.center(),
                              0.5 * along.size() + Vec3::Constant(margin)});
            bounds_.add(boxes_.back().bounds);
        }
}

bool SweptBoxes::meets(const Oriented& swept, const geometry::Box& box) {
    if (!swept.bounds.meets(box)) return false;
    const Vec3 distance = swept.axes * box.center() - swept.centre;
    const Vec3 reach = swept.half + swept.axes.cwiseAbs() * (0.5 * box.size());
    return !(distance.array().abs() > reach.array()).any();
}

void SweptBoxes::meeting(const geometry::Box& box, std::vector<std::uint32_t>& out) const {
    out.clear();
    for (std::uint32_t k = 0; k < boxes_.size(); ++k)
        if (meets(boxes_[k], box)) out.push_back(k);
}

bool SweptBoxes::any_meets(const geometry::Box& box, std::span<const std::uint32_t> among) const {
    return std::any_of(among.begin(), among.end(),
                       [&](const std::uint32_t k) { return meets(boxes_[k], box); });
}

}  // namespace splitcubes::body
