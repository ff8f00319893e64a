// Signed distance to a solid that does not deform, with outward normals.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <memory>

namespace splitcubes::geometry {

/// A solid in its own frame. Queries may run concurrently on several threads.
class SignedDistance {
  public:
    struct Sample {
        double distance = 0;          // m, negative inside
        Vec3 normal = Vec3::UnitZ();  // unit, outward: direction in which the distance grows
    };
    virtual ~SignedDistance() = default;
    virtual Sample at(const Vec3& point) const = 0;
    /// Returns a Lipschitz constant of the distance.
    virtual double lipschitz_constant() const { return 1; }
    /// Returns whether the surface is a plane.
    virtual bool is_flat() const { return false; }
};

/// Creates the half space normal . x <= offset (m). Exact. Throws InputError for a zero normal.
std::shared_ptr<const SignedDistance> make_plane_distance(const Vec3& normal, double offset);
/// Creates a sphere about the origin. Exact. Throws InputError for a radius (m) that is not positive.
std::shared_ptr<const SignedDistance> make_sphere_distance(double radius);
/// Creates a box about the origin, full side lengths in m, edges rounded with radius `rounding` (m, within
/// the box). Exact. Throws InputError for sides that are not positive or a rounding beyond half the shortest.
std::shared_ptr<const SignedDistance> make_box_distance(const Vec3& size, double rounding);
/// Creates the distance to a closed mesh: exact distances and winding numbers at the nodes of a grid of
/// `cells` along the longest side, trilinear between them; edges are rounded by about a third of a cell.
/// Throws InputError for a mesh that encloses nothing.
std::shared_ptr<const SignedDistance> make_mesh_distance(const TriangleMesh& mesh, int cells,
                                                         const Parallel& parallel);

/// Returns the parameter in [0, 1] at which a point moving from `from` to `to` first comes closer to the
/// solid than `margin` (m, > 0); above 1 if it does not; 0 if it starts inside. Uses sphere tracing (Hart
/// 1996), whose steps never pass through the solid.
double first_contact(const SignedDistance& solid, const Vec3& from, const Vec3& to, double margin);

}  // namespace splitcubes::geometry
