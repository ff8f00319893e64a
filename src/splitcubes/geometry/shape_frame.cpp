#include <splitcubes/geometry/shape_frame.h>
#include <splitcubes/geometry/tuning.h>

#include <array>
#include <cmath>
#include <cstddef>

namespace splitcubes::geometry {

namespace {

// Mean of n n n n over the surface, weighted by area.
class NormalMoments {
  public:
    explicit NormalMoments(const TriangleMesh& mesh) {
        double area = 0;
        for (const Triangle& t : mesh.triangles) {
            const Vec3& a = mesh.positions[t[0]];
            const Vec3 cross = (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
            const double weight = cross.stableNorm();
            if (!(weight > 0)) continue;
            area += weight;
            const Vec3 n = cross / weight;
            for (std::size_t k = 0; k < 81; ++k)
                moment_[k] += weight * n[axis(k, 27)] * n[axis(k, 9)] * n[axis(k, 3)] * n[axis(k, 1)];
        }
        if (area > 0)
            for (double& m : moment_) m /= area;
    }
    // Returns the mean of (n.a) (n.b) (n.c) (n.d).
    double of(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) const {
        double out = 0;
        for (std::size_t k = 0; k < 81; ++k)
            out += moment_[k] * a[axis(k, 27)] * b[axis(k, 9)] * c[axis(k, 3)] * d[axis(k, 1)];
        return out;
    }
    double sum_for(const Mat3& axes) const {
        double out = 0;
        for (int k = 0; k < 3; ++k) out += of(axes.col(k), axes.col(k), axes.col(k), axes.col(k));
        return out;
    }

  private:
    static Eigen::Index axis(std::size_t k, std::size_t place) {
        return static_cast<Eigen::Index>(k / place % 3);
    }
    std::array<double, 81> moment_{};
};

// Rotates two axes in their plane to where the sum is largest; returns the angle, rad. With polar coordinates
// r, a of the normal in the plane the two terms of the sum are r^4 (3 + cos 4 (a - angle)) / 4.
double turn_in_plane(const NormalMoments& moments, int i, int j, Mat3& axes) {
    const Vec3 a = axes.col(i), b = axes.col(j);
    const double cosine = moments.of(a, a, a, a) - 6 * moments.of(a, a, b, b) + moments.of(b, b, b, b);
    const double sine = 4 * (moments.of(a, a, a, b) - moments.of(a, b, b, b));
    if (std::hypot(cosine, sine) < tuning::shape_frame::min_moment) return 0;
    const double angle = 0.25 * std::atan2(sine, cosine);
    axes.col(i) = std::cos(angle) * a + std::sin(angle) * b;
    axes.col(j) = std::cos(angle) * b - std::sin(angle) * a;
    return angle;
}

// Jacobi's sweeps over the three planes.
void climb(const NormalMoments& moments, Mat3& axes) {
    for (int sweep = 0; sweep < tuning::shape_frame::max_sweeps; ++sweep) {
        double turned = 0;
        for (int k = 0; k < 3; ++k)
            turned = std::max(turned, std::abs(turn_in_plane(moments, k, (k + 1) % 3, axes)));
        if (turned < tuning::shape_frame::last_turn) break;
    }
}

// Returns rotations from which the sum is climbed; each has its own hill for most shapes.
std::array<Mat3, 8> starts() {
    std::array<Mat3, 8> out;
    out[0].setIdentity();
    const double eighth = std::acos(-1.0) / 4;
    for (std::size_t k = 1; k < 8; ++k) {
        const Vec3 about((k & 1U) != 0 ? 1 : 0, (k & 2U) != 0 ? 1 : 0, (k & 4U) != 0 ? 1 : 0);
        out[k] = Eigen::AngleAxisd(eighth, about.normalized()).toRotationMatrix();
    }
    return out;
}

// Returns the same axes, ordered and directed as near to the identity as they can be.
Mat3 nearest_to_identity(const Mat3& axes) {
    Mat3 best = axes;
    double largest_trace = -4;
    for (int first = 0; first < 3; ++first)
        for (int second = 0; second < 3; ++second)
            for (int signs = 0; signs < 4; ++signs) {
                if (second == first) continue;
                Mat3 tried;
                tried.col(0) = ((signs & 1) != 0 ? -1.0 : 1.0) * axes.col(first);
                tried.col(1) = ((signs & 2) != 0 ? -1.0 : 1.0) * axes.col(second);
                tried.col(2) = tried.col(0).cross(tried.col(1));
                if (tried.trace() <= largest_trace) continue;
                largest_trace = tried.trace();
                best = tried;
            }
    return best;
}

}  // namespace

Mat3 shape_frame(const TriangleMesh& mesh) {
    const NormalMoments moments(mesh);
    const double at_identity = moments.sum_for(Mat3::Identity());
    Mat3 best = Mat3::Identity();
    double largest = at_identity;
    for (Mat3 axes : starts()) {
        climb(moments, axes);
        const double sum = moments.sum_for(axes);
        if (sum <= largest + tuning::shape_frame::same_sum) continue;
        largest = sum;
        best = axes;
    }
    if (largest < tuning::shape_frame::min_sum || largest - at_identity < tuning::shape_frame::min_gain)
        return Mat3::Identity();
    return nearest_to_identity(best);
}

}  // namespace splitcubes::geometry
