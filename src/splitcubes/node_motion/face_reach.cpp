#include <splitcubes/node_motion/face_reach.h>

#include <Eigen/LU>
#include <cmath>

namespace splitcubes::body {

namespace {

// Coordinates in which the face is the unit square at height zero.
struct FaceFrame {
    Mat3 inverse;
    Vec3 origin;

    Vec3 own(const Vec3& world) const { return inverse * (world - origin); }
};

std::optional<FaceFrame> frame_of(const std::array<Vec3, 4>& q) {
    Mat3 axes;
    axes.col(0) = 0.5 * (q[1] - q[0] + q[2] - q[3]);
    axes.col(1) = 0.5 * (q[3] - q[0] + q[2] - q[1]);
    const Vec3 normal = axes.col(0).cross(axes.col(1));
    const double area = normal.norm();
    if (!(area > 0) || !std::isfinite(area)) return std::nullopt;
    axes.col(2) = normal / std::sqrt(area);
    const Vec3 middle = 0.25 * (q[0] + q[1] + q[2] + q[3]);
    return FaceFrame{axes.inverse(), middle - 0.5 * (axes.col(0) + axes.col(1))};
}

std::array<Vec3, 4> corners_at(const MovingFace& face, double fraction) {
    std::array<Vec3, 4> out;
    for (std::size_t k = 0; k < 4; ++k)
        out[k] = geometry::moving_point(face.before[k], face.now[k], fraction);
    return out;
}

geometry::Box box_of_corners(const std::array<Vec3, 4>& points) {
    geometry::Box box;
    for (const Vec3& p : points) box.add(p);
    return box;
}

// Extends the share to where a segment, in the face's coordinates, meets its plane.
void extend(const splitting::FrontRay& ray, const Vec3& from, const Vec3& to, std::optional<double>& share) {
    if (!(from[2] * to[2] <= 0) || from[2] == to[2]) return;
    const Vec3 at = from + from[2] / (from[2] - to[2]) * (to - from);
    const std::optional<double> here = splitting::share_along(ray, at.head<2>());
    if (here && (!share || *here > *share)) share = here;
}

}  // namespace

std::optional<double> reach_in(const MovingFace& face, std::span<const cutting::SweptBlade> swept) {
    std::optional<double> share;
    for (const cutting::SweptBlade& part : swept) {
        const std::array<Vec3, 4> first = corners_at(face, part.begin), last = corners_at(face, part.end);
        geometry::Box box = box_of_corners(first);
        box.add(box_of_corners(last));
        if (!box.meets(part.bounds)) continue;
        const std::optional<FaceFrame> start = frame_of(first), end = frame_of(last);
        if (!start || !end) continue;
        for (const geometry::MovingSegment& s : part.segments) {
            // The swept patch meets the plane in a curve that ends on the rim of the patch.
            const Vec3 a0 = start->own(s.a0), b0 = start->own(s.b0), a1 = end->own(s.a1), b1 = end->own(s.b1);
            extend(face.ray, a0, b0, share);
            extend(face.ray, a1, b1, share);
            extend(face.ray, a0, a1, share);
            extend(face.ray, b0, b1, share);
        }
    }
    return share;
}

}  // namespace splitcubes::body
