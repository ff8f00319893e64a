// Built-in meshes: solids to cut and sheets to cut them with.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

namespace splitcubes::geometry {

// Solids: closed, oriented outward, two triangles an edge; centred at the origin,
// z up, all lengths in m. InputError where a length is not positive and finite or
// a count is too small or absurdly large. Vertices lie on the true surface, so volumes approach the
// true ones from one side as the counts grow.

/// size: whole side lengths.
TriangleMesh make_box(const Vec3& size);
/// An icosahedron, each triangle split in four `subdivisions` times: 20 * 4^subdivisions triangles.
TriangleMesh make_sphere(double radius, int subdivisions = 4);
/// height: whole, along z.
TriangleMesh make_cylinder(double radius, double height, int segments = 64);
/// ring_radius: from the z axis to the middle of the tube, larger than tube_radius.
TriangleMesh make_torus(double ring_radius, double tube_radius, int ring_segments = 96,
                        int tube_segments = 40);
/// straight_height: of the part between the half spheres, along z; may be zero.
TriangleMesh make_capsule(double radius, double straight_height, int segments = 64);
/// A pear: round belly below, narrow neck above, the outline smooth. height: whole, along z.
/// foot: radius of a flat that it stands on, m, below half of what the belly measures; 0: none.
/// Without one the pear stands on a bottom rounder than its centre of mass is high, and tips over.
/// The flat takes off the bottom up to where the outline is that wide; the rest stays where it is.
TriangleMesh make_pear(double height, int segments = 64, double foot = 0);

/// The pear's outline: its radius over half its height at a place along its axis,
/// from -1 (bottom) to 1 (top); 0 outside. Largest 0.65, at -0.35.
double pear_outline(double axis);

// Sheets: open, one normal side, for cutting. half_size: half the side of the
// square, m; resolution: cells along a side. `normal`: of any length above zero.

TriangleMesh make_plane_sheet(const Vec3& center, const Vec3& normal, double half_size, int resolution = 1);
/// The plane sheet raised along its normal by amplitude * sin(2 pi s / wavelength)
/// * cos(2 pi t / wavelength), s and t being lengths along its sides from the centre.
TriangleMesh make_wavy_sheet(const Vec3& center, const Vec3& normal, double half_size, int resolution,
                             double amplitude, double wavelength);

}  // namespace splitcubes::geometry
