// How often a triangle soup winds around a point.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/geometry/winding_lanes.h>

#include <array>
#include <cstdint>
#include <vector>

namespace splitcubes::geometry {

/// The generalised winding number (Jacobson, Kavan, Sorkine-Hornung 2013) of any
/// triangle soup: the sum of the signed solid angles of its triangles over 4 pi.
/// For a closed outward-oriented mesh 1 inside and 0 outside; for an open one a
/// harmonic function that jumps by 1 across each triangle.
///
/// A tree over the triangles holds the moments of their area vectors; a node
/// further away than 3.25 times its radius is evaluated by its Taylor expansion (Barill
/// et al. 2018), of second order. Queries may run at the same
/// time on several threads and depend on nothing but the mesh and the point.
class WindingNumber {
  public:
    /// O(n log n). Triangles without area are left out. Throws InputError for an
    /// index out of range or a used vertex that is not finite.
    explicit WindingNumber(const TriangleMesh& mesh);

    /// Within about 1e-3 of exact_at, mostly far better. Point in m, in the mesh's frame.
    double at(const Vec3& point) const;
    /// What quick_at found.
    struct Estimate {
        double value;
        double tolerance;        // by which at() may differ
        std::size_t near_count;  // triangles that were summed one by one
    };
    /// at(point) but for rounding; many times faster where many triangles are near.
    Estimate quick_at(const Vec3& point) const;
    /// Whether |at(point)| > limit, by quick_at wherever rounding does not decide it.
    bool exceeds(const Vec3& point, double limit) const;
    /// The sum over all triangles (van Oosterom and Strackee 1983). On a triangle
    /// itself the mean of the values on its two sides.
    double exact_at(const Vec3& point) const;

  private:
    // Lengths in the tree are in the mesh's own unit: (m - center_) * scale_.
    struct Node {
        Vec3 center;               // area-weighted mean of the triangles' centroids
        double opening_distance2;  // squared distance beyond which the expansion holds
        double whole_distance;     // within it all triangles are summed one by one; negative: nowhere
        // Harmonic parts of the moments of the triangles' area vectors with their
        // factors of the series; polynomials, see the source for the order of entries.
        std::array<double, 3> zeroth;
        std::array<double, 6> first;
        std::array<double, 10> second;
        std::uint32_t begin, end;  // triangles in corners_
        std::uint32_t skip;        // the node that follows this one's subtree, in depth-first order
        bool leaf;
    };
    using Corners = std::array<Vec3, 3>;
    struct Builder;

    static double expansion(const Node& node, const Vec3& r, double distance2);

    std::vector<Node> nodes_;       // depth first, the root first
    std::vector<Corners> corners_;  // by triangle, in the order of the leaves
    WindingLanes lanes_;            // the same
    Vec3 center_ = Vec3::Zero();    // m
    double scale_ = 1;              // 1/m
};

}  // namespace splitcubes::geometry
