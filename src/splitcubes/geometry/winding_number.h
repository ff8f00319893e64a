// Generalised winding number of a triangle soup.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/geometry/winding_lanes.h>

#include <array>
#include <cstdint>
#include <vector>

namespace splitcubes::geometry {

/// The generalised winding number (Jacobson, Kavan, Sorkine-Hornung 2013) of any triangle soup: the sum of
/// the signed solid angles of its triangles over 4 pi. For a closed outward-oriented mesh it is 1 inside and
/// 0 outside; for an open one a harmonic function that jumps by 1 across each triangle.
///
/// A tree over the triangles holds the moments of their area vectors; a node further away than 3.25 times its
/// radius is evaluated by its second-order Taylor expansion (Barill et al. 2018). Queries may run
/// concurrently and depend on the mesh and the point only.
class WindingNumber {
  public:
    /// O(n log n). Triangles without area are skipped. Throws InputError for an index out of range or a used
    /// vertex that is not finite.
    explicit WindingNumber(const TriangleMesh& mesh);

    /// Returns the winding number within about 1e-3 of exact_at, usually much closer. Point in m, in the
    /// mesh's frame.
    double at(const Vec3& point) const;
    /// Result of quick_at.
    struct Estimate {
        double value;
        double tolerance;        // bound on the difference from at()
        std::size_t near_count;  // triangles that were summed individually
    };
    /// Returns at(point) up to rounding; many times faster if many triangles are near.
    Estimate quick_at(const Vec3& point) const;
    /// Returns whether |at(point)| > limit; uses quick_at unless rounding decides.
    bool exceeds(const Vec3& point, double limit) const;
    /// Returns the sum over all triangles (van Oosterom and Strackee 1983). On a triangle: the mean of the
    /// values on its two sides.
    double exact_at(const Vec3& point) const;

  private:
    // Lengths in the tree are in the mesh's own unit: (m - center_) * scale_.
    struct Node {
        Vec3 center;               // area-weighted mean of the triangles' centroids
        double opening_distance2;  // squared distance beyond which the expansion holds
        double whole_distance;     // below it all triangles are summed individually; negative: nowhere
        // Harmonic parts of the moments of the triangles' area vectors, including the factors of the series;
        // polynomials with the order of entries given in the source.
        std::array<double, 3> zeroth;
        std::array<double, 6> first;
        std::array<double, 10> second;
        std::uint32_t begin, end;  // triangles in corners_
        std::uint32_t skip;        // index of the node after this one's subtree, in depth-first order
        bool leaf;
    };
    using Corners = std::array<Vec3, 3>;
    struct Builder;

    static double expansion(const Node& node, const Vec3& r, double distance2);

    std::vector<Node> nodes_;       // depth first, the root first
    std::vector<Corners> corners_;  // by triangle, in the order of the leaves
    WindingLanes lanes_;            // the same triangles
    Vec3 center_ = Vec3::Zero();    // m
    double scale_ = 1;              // 1/m
};

}  // namespace splitcubes::geometry
