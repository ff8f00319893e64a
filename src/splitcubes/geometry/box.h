// Axis-aligned boxes.
#pragma once

#include <splitcubes/math/types.h>

#include <limits>

namespace splitcubes::geometry {

/// Closed axis-aligned box; empty if min > max on an axis, as by default.
struct Box {
    Vec3 min = Vec3::Constant(std::numeric_limits<double>::infinity());
    Vec3 max = Vec3::Constant(-std::numeric_limits<double>::infinity());

    bool empty() const { return (min.array() > max.array()).any(); }
    void add(const Vec3& point) {
        min = min.cwiseMin(point);
        max = max.cwiseMax(point);
    }
    void add(const Box& box) {
        min = min.cwiseMin(box.min);
        max = max.cwiseMax(box.max);
    }
    Box grown(double margin) const { return {min - Vec3::Constant(margin), max + Vec3::Constant(margin)}; }
    Vec3 size() const { return max - min; }
    Vec3 center() const { return 0.5 * (min + max); }
    /// For checkpoints.
    template <class Archive>
    void serialize(Archive& archive) {
        archive(min, max);
    }
    bool contains(const Vec3& point) const {
        return (point.array() >= min.array()).all() && (point.array() <= max.array()).all();
    }
    bool meets(const Box& other) const {
        return (min.array() <= other.max.array()).all() && (other.min.array() <= max.array()).all();
    }
};

}  // namespace splitcubes::geometry
