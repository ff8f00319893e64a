// Nearest point on a triangle soup.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace splitcubes::geometry {

/// Bounding volume tree over the triangles of any mesh. Queries may run concurrently on
/// several threads; results depend only on the mesh and the query.
class NearestPoint {
  public:
    static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

    struct Hit {
        std::uint32_t triangle = none;
        std::array<double, 3> weights{};                            // barycentric; each in [0, 1], sum 1
        double distance = std::numeric_limits<double>::infinity();  // m
    };
    struct Query {
        Vec3 point;  // m
        /// Triangles whose normal has a negative dot product with this one count as further
        /// away by `back_side_penalty` (m, >= 0). Zero: no preference.
        Vec3 normal = Vec3::Zero();
        double back_side_penalty = 0;
        /// Only triangles with labels[triangle] == label; empty labels: all.
        std::span<const std::int32_t> labels = {};
        std::int32_t label = 0;
        /// A triangle that is probably near; speeds up the search without changing its result.
        std::uint32_t guess = none;
    };

    /// Builds the tree, O(n log n). Indices must be in range, positions finite.
    explicit NearestPoint(const TriangleMesh& mesh);

    /// Returns the nearest point; ties go to the triangle with the lowest index. Without an
    /// allowed triangle, Hit::triangle is `none`.
    Hit at(const Query& query) const;

  private:
    struct Node {
        Box box;
        std::uint32_t begin, end;  // leaf: range in order_; inner node: begin == end
        std::uint32_t second;      // inner node: its second child; the first follows it
    };
    struct Corners {
        Vec3 a, b, c;
    };
    std::uint32_t build(std::uint32_t begin, std::uint32_t end, std::span<const Vec3> centroids, int depth);
    void consider(std::uint32_t slot, const Query& query, Hit& best, double& best_value) const;

    std::vector<Node> nodes_;             // depth first, the root first
    std::vector<std::uint32_t> order_;    // triangles, leaf by leaf
    std::vector<Corners> corners_;        // in the same order
    std::vector<std::uint32_t> slot_of_;  // per triangle: its position in order_
    double slack_ = 0;                    // m, exceeds the rounding error of a distance
};

/// Returns the barycentric weights of the triangle's point nearest to `point`; each in
/// [0, 1], sum 1. Degenerate triangles are allowed.
std::array<double, 3> nearest_weights(const Vec3& point, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace splitcubes::geometry
