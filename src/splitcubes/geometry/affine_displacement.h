// Affine displacements for weighted sums.
#pragma once

#include <splitcubes/geometry/frame.h>

#include <cstddef>

namespace splitcubes::geometry {

/// Displacement of rest points by an affine motion: point p moves to p + gradient p + shift. All twelve
/// numbers are in one array, so a weighted sum is one loop without branches; at rest all are zero.
class AffineDisplacement {
  public:
    static constexpr std::size_t entry_count = 12;

    AffineDisplacement() = default;
    /// Creates the motion whose frame at the point `rest` (m) is `frame`.
    AffineDisplacement(const Vec3& rest, const Frame& frame)
        : AffineDisplacement(rest, frame.position, frame.jacobian) {}
    AffineDisplacement(const Vec3& rest, const Vec3& position, const Mat3& jacobian) {
        Eigen::Map<Mat3> gradient(entries_.data());
        gradient = jacobian - Mat3::Identity();
        entries_.tail<3>() = position - rest - gradient * rest;
    }

    void add(double weight, const AffineDisplacement& other) { entries_ += weight * other.entries_; }
    void scale(double factor) { entries_ *= factor; }

    Mat3 jacobian() const { return Mat3::Identity() + Eigen::Map<const Mat3>(entries_.data()); }
    /// Returns the deformed position of a rest point, m.
    Vec3 image(const Vec3& point) const {
        return point + (entries_.tail<3>() + Eigen::Map<const Mat3>(entries_.data()) * point);
    }

    /// The twelve numbers: the gradient by columns, then the shift (m).
    const double* entries() const { return entries_.data(); }
    double* entries() { return entries_.data(); }

  private:
    Eigen::Matrix<double, 12, 1, Eigen::DontAlign> entries_ =
        Eigen::Matrix<double, 12, 1, Eigen::DontAlign>::Zero();  // gradient by columns, then shift (m)
};

}  // namespace splitcubes::geometry
