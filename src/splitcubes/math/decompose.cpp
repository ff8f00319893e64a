#include <splitcubes/math/decompose.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace splitcubes {

namespace {

// Applies one Jacobi rotation in the plane (p, q) to S and accumulates it in V.
void rotate(Mat3& S, Mat3& V, int p, int q) {
    const double off = S(p, q);
    if (off == 0) return;
    const double theta = (S(q, q) - S(p, p)) / (2 * off);
    // The smaller root; zero if theta is so large that its square overflows.
    const double t = std::copysign(1.0, theta) / (std::abs(theta) + std::sqrt(theta * theta + 1));
    const double c = 1 / std::sqrt(t * t + 1);
    const double s = t * c;
    const int r = 3 - p - q;
    S(p, p) -= t * off;
    S(q, q) += t * off;
    S(p, q) = S(q, p) = 0;
    const double rp = S(r, p);
    const double rq = S(r, q);
    S(r, p) = S(p, r) = c * rp - s * rq;
    S(r, q) = S(q, r) = s * rp + c * rq;
    const Vec3 vp = V.col(p);
    const Vec3 vq = V.col(q);
    V.col(p) = c * vp - s * vq;
    V.col(q) = s * vp + c * vq;
}

// Returns a unit vector perpendicular to a unit vector, by a fixed choice.
Vec3 perpendicular(const Vec3& unit) {
    int axis = 0;
    unit.cwiseAbs().minCoeff(&axis);
    return unit.cross(Vec3::Unit(axis)).normalized();
}

// Computes the polar factor by Newton-Schulz iteration, which converges quadratically, but only near a
// rotation. Returns false if it has not converged.
bool newton_schulz(const Mat3& F, Mat3& rotation) {
    Mat3 X = F;
    for (int iteration = 0; iteration < 8; ++iteration) {
        const Mat3 XtX = X.transpose() * X;
        const double error = (XtX - Mat3::Identity()).squaredNorm();
        if (!(error < 0.09)) return false;
        if (error < 1e-31) break;
        X = X * (1.5 * Mat3::Identity() - 0.5 * XtX);
        // The error after this step is about 3/4 error^2, so no further test is needed.
        if (error < 1e-17) break;
    }
    rotation = X;
    return X.determinant() > 0;
}

}  // namespace

SymmetricEigen eigen_symmetric(const Mat3& matrix) {
    Mat3 S = matrix.selfadjointView<Eigen::Lower>();
    Mat3 V = Mat3::Identity();
    const double scale = S.cwiseAbs().maxCoeff();
    for (int sweep = 0; sweep < 12; ++sweep) {
        const double off = std::abs(S(0, 1)) + std::abs(S(0, 2)) + std::abs(S(1, 2));
        if (!(off > 1e-17 * scale)) break;
        rotate(S, V, 0, 1);
        rotate(S, V, 0, 2);
        rotate(S, V, 1, 2);
    }
    SymmetricEigen result{S.diagonal(), V};
    const auto order = [&](int a, int b) {
        if (result.values[a] >= result.values[b]) return;
        std::swap(result.values[a], result.values[b]);
        const Vec3 column = result.vectors.col(a);
        result.vectors.col(a) = result.vectors.col(b);
        result.vectors.col(b) = column;
    };
    order(0, 1);
    order(1, 2);
    order(0, 1);
    if (result.vectors.determinant() < 0) result.vectors.col(2) = -result.vectors.col(2);
    return result;
}

// Tests the pivots of L D L^T; their signs are those of a matrix that differs by rounding.
bool has_eigenvalues_below(const Mat3& matrix, double limit) {
    const double first = limit - matrix(0, 0);
    const double a = matrix(1, 0) / first, b = matrix(2, 0) / first;
    const double second = limit - matrix(1, 1) - a * matrix(1, 0);
    const double across = matrix(2, 1) + b * matrix(1, 0);
    const double third = limit - matrix(2, 2) - b * matrix(2, 0) - across * across / second;
    return first > 0 && second > 0 && third > 0;
}

namespace {

// What the roots of the characteristic cubic depend on (Smith 1961): the largest is mean + 2 spread
// cos(acos(share) / 3).
struct CharacteristicCubic {
    double mean;
    Mat3 off;  // the matrix without its mean
    double spread;
    double share;  // -1 to 1
};

CharacteristicCubic characteristic_cubic(const Mat3& matrix) {
    CharacteristicCubic out;
    out.mean = matrix.trace() / 3;
    out.off = matrix - out.mean * Mat3::Identity();
    out.spread = std::sqrt(out.off.squaredNorm() / 6);
    const double cubed = out.spread * out.spread * out.spread;
    const double share = cubed > 0 ? 0.5 * out.off.determinant() / cubed : 1;
    out.share = share < 1 ? std::max(share, -1.0) : 1;
    return out;
}

}  // namespace

// Takes out the eigenvalue that is farther from the middle one, of which the root of the characteristic cubic
// (Smith 1961) and the eigenvector are accurate; the plane of the others is left.
Mat3 positive_part(const Mat3& matrix) {
    if (has_eigenvalues_below(matrix, 0)) return Mat3::Zero();
    if (has_eigenvalues_below(-matrix, 0)) return matrix;
    const auto [mean, off, spread, share] = characteristic_cubic(matrix);
    if (!(spread * spread * spread > 0)) return std::max(mean, 0.0) * Mat3::Identity();
    const double root = std::copysign(2 * spread * std::cos(std::acos(std::abs(share)) / 3), share);
    const Mat3 shifted = off - root * Mat3::Identity();
    Vec3 axis = Vec3::Zero();
    for (int k = 0; k < 3; ++k) {
        const Vec3 normal = shifted.col(k).cross(shifted.col((k + 1) % 3));
        if (normal.squaredNorm() > axis.squaredNorm()) axis = normal;
    }
    axis.normalize();
    const Vec3 u = perpendicular(axis), w = axis.cross(u);
    const Vec3 image_of_u = matrix * u, image_of_w = matrix * w;
    const double middle = 0.5 * (u.dot(image_of_u) + w.dot(image_of_w));
    const double half = 0.5 * (u.dot(image_of_u) - w.dot(image_of_w)), across = u.dot(image_of_w);
    const double radius = std::hypot(half, across);
    const double larger = std::max(middle + radius, 0.0), smaller = std::max(middle - radius, 0.0);
    const double slope = radius > 0 ? 0.5 * (larger - smaller) / radius : 0;
    const double positive_middle = 0.5 * (larger + smaller);
    return std::max(axis.dot(matrix * axis), 0.0) * axis * axis.transpose() +
           (positive_middle + slope * half) * u * u.transpose() +
           (positive_middle - slope * half) * w * w.transpose() +
           slope * across * (u * w.transpose() + w * u.transpose());
}

double largest_eigenvalue_bound(const Mat3& matrix) {
    // Far above the error of the cosines, which is the square root of machine precision if two eigenvalues
    // are equal.
    constexpr double slack = 1e-7;
    const CharacteristicCubic cubic = characteristic_cubic(matrix);
    return cubic.mean + 2 * cubic.spread * std::cos(std::acos(cubic.share) / 3) + slack * matrix.norm();
}

Mat3 rotation_of(const Mat3& F, const Mat3& last) {
    Mat3 rotation;
    if (newton_schulz(F, rotation)) return rotation;
    const double size = F.cwiseAbs().maxCoeff();
    if (!(size > 0) || !std::isfinite(size)) return last;
    const Mat3 G = F / size;
    const Mat3 V = eigen_symmetric(G.transpose() * G).vectors;
    const Vec3 u0 = (G * V.col(0)).normalized();
    const Vec3 image = G * V.col(1);
    const Vec3 rest = image - u0 * u0.dot(image);
    const double second = rest.norm();
    // F V_1 has an error of about 1e-16 along u0 only; 1e-12 keeps four digits.
    if (second < 1e-12) {
        const Mat3 rotated = minimal_rotation(last * V.col(0), u0) * last;
        return rotated;
    }
    Mat3 U;
    U.col(0) = u0;
    U.col(1) = rest / second;
    U.col(2) = u0.cross(Vec3(U.col(1)));
    return U * V.transpose();
}

Mat3 minimal_rotation(const Vec3& from, const Vec3& to) {
    const double from_length = from.norm();
    const double to_length = to.norm();
    if (!(from_length > 0) || !(to_length > 0)) return Mat3::Identity();
    const Vec3 a = from / from_length;
    const Vec3 b = to / to_length;
    const double cosine = a.dot(b);
    if (cosine < 0) {
        // Rotates to -b first, which is close to a, then by half a turn about an axis perpendicular to b: the
        // common perpendicular of both if there is one.
        const Vec3 cross = a.cross(b);
        const Vec3 across = cross - b * b.dot(cross);
        const Vec3 axis = across.norm() > 1e-12 ? Vec3(across.normalized()) : perpendicular(b);
        return (2 * axis * axis.transpose() - Mat3::Identity()) * minimal_rotation(a, -b);
    }
    const Vec3 v = a.cross(b);
    Mat3 cross;
    cross << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return Mat3::Identity() + cross + cross * cross / (1 + cosine);
}

}  // namespace splitcubes
