// The axes that the surface of a solid follows.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

namespace splitcubes::geometry {

/// Returns orthonormal axes, as columns of a rotation, that the faces of a mesh follow: those that maximise
/// the mean of the sum of fourth powers of the normal's components, weighted by area. For a box these are its
/// edges, for a rod its axis and any two directions across it. The sum is 1 if all faces are perpendicular to
/// an axis and 0.6 for a sphere. The identity is returned for shapes that follow no axes (a sum below 0.7)
/// and if other axes would gain less than 0.002 (a rotation of two degrees). Of the 24 ways to order and
/// direct the axes it is the one nearest to the identity. Stable: close meshes have close axes, except where
/// the choice changes.
Mat3 shape_frame(const TriangleMesh& mesh);

}  // namespace splitcubes::geometry
