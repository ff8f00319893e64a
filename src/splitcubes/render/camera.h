// Camera of a picture.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/math/types.h>

namespace splitcubes::render {

/// A perspective camera. `up` need not be perpendicular to the view.
struct Camera {
    Vec3 eye = Vec3(0, -5, 2);           // m, world
    Vec3 target = Vec3::Zero();          // m, world
    Vec3 up = Vec3::UnitZ();             // direction, world
    double vertical_fov_degrees = 35.0;  // full opening angle
};

/// Returns the nearest camera that looks at the middle of the box, from the side that `direction` (box to
/// eye, any length) points to, and has all of the box in view. aspect: width / height. margin: factor for
/// free space around the box (1: none). Throws InputError for an empty box, a zero direction or an angle
/// outside (0, 180).
Camera frame_camera(const geometry::Box& box, const Vec3& direction, double vertical_fov_degrees,
                    double aspect, const Vec3& up = Vec3::UnitZ(), double margin = 1.04);

}  // namespace splitcubes::render
