// How far a point is from a solid that does not deform, and which way is out.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <memory>

namespace splitcubes::geometry {

/// A solid in its own frame. Queries may run at the same time on several threads.
class SignedDistance {
  public:
    struct Sample {
        double distance = 0;          // m, negative inside
        Vec3 normal = Vec3::UnitZ();  // unit, outward: the direction in which it grows
    };
    virtual ~SignedDistance() = default;
    virtual Sample at(const Vec3& point) const = 0;
    /// No two points' distances differ by more than this times the way between them.
    virtual double steepness() const { return 1; }
    /// Whether its surface is a plane.
    virtual bool is_flat() const { return false; }
};

/// The half space normal . x <= offset (m). Exact. InputError for a normal without direction.
std::shared_ptr<const SignedDistance> make_plane_distance(const Vec3& normal, double offset);
/// About the origin. Exact. InputError for a radius (m) that is not positive.
std::shared_ptr<const SignedDistance> make_sphere_distance(double radius);
/// About the origin, whole side lengths in m, edges rounded by `rounding` (m, within the box).
/// Exact. InputError for sides that are not positive or a rounding beyond half the shortest.
std::shared_ptr<const SignedDistance> make_box_distance(const Vec3& size, double rounding);
/// Of a closed mesh: exact distances and winding numbers at the nodes of a grid of `cells`
/// along the longest side, trilinear between them; edges are rounded by about a third of a
/// cell. InputError for a mesh that encloses nothing.
std::shared_ptr<const SignedDistance> make_mesh_distance(const TriangleMesh& mesh, int cells,
                                                         const Parallel& parallel);

/// Where a point that goes along a straight line first comes nearer to the solid than
/// `margin` (m, > 0), as a share of its way in [0, 1]; above 1 where it does not. The point may
/// begin inside: 0. By steps of the distance, which never go through anything
/// (sphere tracing, Hart 1996).
double first_contact(const SignedDistance& solid, const Vec3& from, const Vec3& to, double margin);

}  // namespace splitcubes::geometry
