// The local affine motion at a rest point.
#pragma once

#include <splitcubes/math/types.h>

namespace splitcubes::geometry {

/// Where a rest point X is now and how its surroundings are carried along:
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
