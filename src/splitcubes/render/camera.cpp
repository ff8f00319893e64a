#include <splitcubes/core/error.h>
#include <splitcubes/render/camera.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace splitcubes::render {

Camera frame_camera(const geometry::Box& box, const Vec3& direction, double vertical_fov_degrees,
                    double aspect, const Vec3& up, double margin) {
    if (box.empty() || !box.min.allFinite() || !box.max.allFinite()) {
        throw InputError("frame_camera: box", "has no extent to look at", "frame a scene with points in it");
    }
    if (!(direction.norm() > 0) || !direction.allFinite()) {
        throw InputError("frame_camera: direction", "has no length");
    }
    if (!(vertical_fov_degrees > 0 && vertical_fov_degrees < 180)) {
        throw InputError("frame_camera: vertical_fov_degrees",
                         "is not between 0 and 180 (" + std::to_string(vertical_fov_degrees) + ")");
    }
    if (!(aspect > 0) || !(margin > 0))
        throw InputError("frame_camera", "aspect and margin must be positive");
    const Vec3 back = direction.normalized();
    Vec3 right = up.cross(back);
    // If the view is along up, any direction can be the picture's upper edge.
    if (right.norm() < 1e-9 * up.norm() || !(right.norm() > 0)) right = back.unitOrthogonal();
    right.normalize();
    const Vec3 top = back.cross(right);
    const double tan_vertical = std::tan(vertical_fov_degrees * std::numbers::pi / 360);
    const double tan_horizontal = tan_vertical * aspect;
    const Vec3 half = 0.5 * margin * box.size();
    // A corner is in view if |x| <= (distance - z) tan.
    double distance = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3 offset((corner & 1) != 0 ? half.x() : -half.x(), (corner & 2) != 0 ? half.y() : -half.y(),
                          (corner & 4) != 0 ? half.z() : -half.z());
        const double depth = offset.dot(back);
        distance = std::max({distance, depth + std::abs(offset.dot(right)) / tan_horizontal,
                             depth + std::abs(offset.dot(top)) / tan_vertical});
    }
    if (!(distance > 0)) distance = 1;  // a single point
    return {.eye = box.center() + distance * back,
            .target = box.center(),
            .up = top,
            .vertical_fov_degrees = vertical_fov_degrees};
}

}  // namespace splitcubes::render
