// Built-in meshes: solids to cut, and sheets for cutting.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

namespace splitcubes::geometry {

// Solids are closed, oriented outward, with two triangles per edge; centred at the origin,
// z up, all lengths in m. InputError is thrown if a length is not positive and finite or a
// count is too small or absurdly large. Vertices lie on the exact surface, so volumes
// converge to the exact ones from one side as the counts grow.

/// size: full side lengths.
TriangleMesh make_box(const Vec3& size);
/// An icosahedron, each triangle split in four `subdivisions` times: 20 * 4^subdivisions triangles.
TriangleMesh make_sphere(double radius, int subdivisions = 4);
/// height: full, along z.
TriangleMesh make_cylinder(double radius, double height, int segments = 64);
/// ring_radius: from the z axis to the middle of the tube, larger than tube_radius.
TriangleMesh make_torus(double ring_radius, double tube_radius, int ring_segments = 96,
                        int tube_segments = 40);
/// straight_height: length between the half spheres, along z; may be zero.
TriangleMesh make_capsule(double radius, double straight_height, int segments = 64);
/// A pear with a smooth outline: round belly below, narrow neck above. height: full, along z.
/// foot: radius of a flat base, m, below half of the belly's radius; 0: none. Without a base the pear tips
/// over, since its centre of mass is higher than the bottom's radius of curvature. The base cuts off the
/// bottom at the height where the outline has that radius; the rest is unchanged.
TriangleMesh make_pear(double height, int segments = 64, double foot = 0);

/// Returns the pear's radius divided by half its height at a position along its axis, from
/// -1 (bottom) to 1 (top); 0 outside. The maximum is 0.65 at -0.35.
double pear_outline(double axis);

// Sheets are open surfaces for cutting. half_size: half the side of the square, m;
// resolution: cells along a side; normal: any positive length.

TriangleMesh make_plane_sheet(const Vec3& center, const Vec3& normal, double half_size, int resolution = 1);
/// The plane sheet displaced along its normal by amplitude * sin(2 pi s / wavelength)
/// * cos(2 pi t / wavelength), where s and t are lengths along its sides from the centre.
TriangleMesh make_wavy_sheet(const Vec3& center, const Vec3& normal, double half_size, int resolution,
                             double amplitude, double wavelength);

}  // namespace splitcubes::geometry
