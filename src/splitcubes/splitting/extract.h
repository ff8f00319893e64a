// Extraction of indexed meshes from a Surface.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/surface.h>

#include <functional>
#include <span>

namespace splitcubes::splitting {

/// Returns the surface as an indexed mesh. positions and normals: one per surface.vertices() (see deform);
/// empty spans mean the rest state. `rest` is filled either way. Cells share vertices, so the mesh is closed
/// by index; both sides of a cut have their own vertices, at the same rest position.
geometry::SurfaceMesh extract(const NodeGrid& grid, const Surface& surface, const Pieces& pieces,
                              std::span<const Vec3> positions = {}, std::span<const Vec3> normals = {},
                              const Parallel& parallel = Parallel(1));

/// Returns the closed mesh of one piece of an extracted surface, with its attributes.
geometry::SurfaceMesh extract_piece(const geometry::SurfaceMesh& surface, std::int32_t piece);

/// Returns the pieces whose flag in `wanted` is not zero as one mesh; `wanted` has one flag per piece.
geometry::SurfaceMesh extract_pieces(const geometry::SurfaceMesh& surface,
                                     std::span<const std::uint8_t> wanted);

struct PieceMeasure {
    std::size_t triangles = 0;
    double volume = 0;                   // m^3
    double boundary_area = 0;            // m^2
    double cut_area = 0;                 // m^2
    geometry::Box bounds;                // m
    Vec3 center_of_mass = Vec3::Zero();  // m, of uniform material; centre of the bounds if the volume of a
                                         // tiny piece is too near zero
};

/// Returns the measures of each piece, by index.
std::vector<PieceMeasure> measure_pieces(const geometry::SurfaceMesh& surface, std::size_t piece_count);

}  // namespace splitcubes::splitting
