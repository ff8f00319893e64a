// Local affine motion at a rest point.
#pragma once

#include <splitcubes/math/types.h>

namespace splitcubes::geometry {

/// World position of a rest point X and the affine motion of its surroundings:
/// a point p near X moves to position + jacobian (p - X).
struct Frame {
    Vec3 position = Vec3::Zero();      // m, world
    Mat3 jacobian = Mat3::Identity();  // d world / d rest

    /// For checkpoints.
    template <class Archive>
    void serialize(Archive& archive) {
        archive(position, jacobian);
    }
};

}  // namespace splitcubes::geometry
