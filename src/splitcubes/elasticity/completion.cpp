#include <splitcubes/elasticity/elasticity.h>
#include <splitcubes/math/cross_matrix.h>

namespace splitcubes::meshless {

Completion::Completion(int rank, const Mat3& basis, const Mat3& F, const Mat3& R) {
    if (rank != 1 && rank != 2) return;
    const Mat3& shape = is_distorted(F, R) ? R : F;
    const Vec3 image0 = shape * basis.col(0);
    if (rank == 1) {
        direction_ = basis.col(0);
        image_ = image0 / image0.squaredNorm();
        follow_ = R - R * direction_ * direction_.transpose();
    } else {
        direction_ = basis.col(2);
        const Vec3 image1 = shape * basis.col(1), cross = image0.cross(image1);
        // The dual basis of the images in their plane.
        const double square = cross.squaredNorm();
        if (!(square > 1e-24 * image0.squaredNorm() * image1.squaredNorm())) return;
        const Vec3 dual0 = image1.cross(cross) / square, dual1 = cross.cross(image0) / square;
        image_ = F * direction_;
        follow_ = dual0 * basis.col(0).transpose() + dual1 * basis.col(1).transpose();
    }
    if (image_.allFinite() && follow_.allFinite()) rank_ = static_cast<std::uint8_t>(rank);
}

Vec3 Completion::normal_change(const Mat3& dH) const {
    if (rank_ != 2) return Vec3::Zero();
    return -follow_ * (dH.transpose() * image_);
}

Mat3 Completion::resolve_normal(const Vec3& f) const {
    if (rank_ != 2) return Mat3::Zero();
    return -image_ * (follow_.transpose() * f).transpose();
}

Mat3 Completion::complete(const Mat3& dH) const {
    if (rank_ == 2) return dH + normal_change(dH) * direction_.transpose();
    if (rank_ == 1) return dH + cross_matrix(image_.cross(dH * direction_)) * follow_;
    return dH;
}

Mat3 Completion::resolve(const Mat3& P) const {
    if (rank_ == 2) return P + resolve_normal(P * direction_);
    if (rank_ != 1) return P;
    Vec3 axial = Vec3::Zero();
    for (int k = 0; k < 3; ++k) axial += Vec3(follow_.col(k)).cross(Vec3(P.col(k)));
    return P + axial.cross(image_) * direction_.transpose();
}

}  // namespace splitcubes::meshless
