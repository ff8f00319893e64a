// Conversions between the public interface's vectors and those that are calculated with.
#pragma once

#include <splitcubes/api/types.h>
#include <splitcubes/math/types.h>

namespace splitcubes::view {

inline Vec3 to_eigen(const Vector3& v) {
    return {v.x, v.y, v.z};
}
inline Vector3 to_public(const Vec3& v) {
    return {v.x(), v.y(), v.z()};
}
inline Isometry to_eigen(const Pose& pose) {
    Isometry out = Isometry::Identity();
    const Quaternion& q = pose.rotation;
    out.linear() = Quat(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
    out.translation() = to_eigen(pose.position);
    return out;
}
inline Pose to_public(const Isometry& frame) {
    const Quat q(frame.linear());
    return {to_public(Vec3(frame.translation())), {q.w(), q.x(), q.y(), q.z()}};
}

/// A half line.
struct Ray {
    Vec3 origin = Vec3::Zero();      // m, world
    Vec3 direction = Vec3::UnitZ();  // unit
    Vec3 at(double distance) const { return origin + distance * direction; }
};

}  // namespace splitcubes::view
