// Indexed meshes out of a Surface.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/surface.h>

#include <functional>
#include <span>

namespace splitcubes::splitting {

/// The surface as an indexed mesh. positions and normals: one per
/// surface.vertices() (see deform); empty spans take the rest state. `rest` is
/// filled either way. Vertices
/// are shared between cells, so the mesh is closed by index; the two sides of a
/// cut have vertices of their own, at the same place at rest.
geometry::SurfaceMesh extract(const NodeGrid& grid, const Surface& surface, const Pieces& pieces,
                              std::span<const Vec3> positions = {}, std::span<const Vec3> normals = {},
                              const Parallel& parallel = Parallel(1));

/// The closed mesh of one piece of an extracted surface, with its share of all attributes.
geometry::SurfaceMesh extract_piece(const geometry::SurfaceMesh& whole, std::int32_t piece);

/// The pieces whose flag in `wanted` is not zero, together; `wanted` has one a piece.
geometry::SurfaceMesh extract_pieces(const geometry::SurfaceMesh& whole,
                                     std::span<const std::uint8_t> wanted);

struct PieceMeasure {
    std::size_t triangles = 0;
    double volume = 0;                   // m^3
    double boundary_area = 0;            // m^2
    double cut_area = 0;                 // m^2
    geometry::Box bounds;                // m
    Vec3 center_of_mass = Vec3::Zero();  // m, of uniform material; the bounds' centre for a
                                         // crumb whose volume is too near zero to have one
};

/// Measures of each piece, by number.
std::vector<PieceMeasure> measure_pieces(const geometry::SurfaceMesh& whole, std::size_t piece_count);

}  // namespace splitcubes::splitting
