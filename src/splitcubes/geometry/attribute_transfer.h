// Transfer of texture coordinates, colours and materials from a mesh to its resampled surface.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/nearest_point.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace splitcubes::geometry {

/// Names of materials that a transfer adds.
inline constexpr const char* boundary_material = "boundary";
inline constexpr const char* cut_material = "cut";

/// Base colours, linear, of faces without an input material.
inline constexpr Rgba boundary_colour{0.72F, 0.66F, 0.58F, 1.0F};
inline constexpr Rgba cut_colour{0.75F, 0.13F, 0.11F, 1.0F};

/// Returns materials `boundary` and `cut` by the triangles' origin, for a surface without
/// attributes that is combined with one that has some.
MeshAttributes attributes_by_origin(const SurfaceMesh& surface);

/// Transfers the attributes of one input mesh in rest space.
///
/// A triangle of origin boundary takes the material of the input triangle nearest to its
/// centroid. Each of its corners takes the texture coordinate and colour of the nearest
/// point within that triangle's chart (see attribute_charts). So no triangle spans a UV
/// seam; the seams of the result run along its edges, within about a cell of the input's.
///
/// A triangle of origin cut gets the material `cut` (the input's own, if it has one of
/// that name), texture coordinates (0, 0), and the cut colour if the input has colours.
/// Boundary triangles whose input triangle has no material get one named `boundary`. Both
/// are appended to the input's materials if needed.
class AttributeTransfer {
  public:
    /// input: at rest; attributes: of its triangles. side_tolerance: m, added to the
    /// distance of input triangles that face away from the surface's triangle, so that a
    /// thin wall does not take the other side's colour; half a cell is a good value.
    /// O(n log n).
    AttributeTransfer(const TriangleMesh& input, MeshAttributes attributes, double side_tolerance);

    /// Returns attributes for the surface's triangles; empty if the input has none. Uses
    /// surface.rest, or the positions if that is empty. The same bits for any number of
    /// threads; the result of a triangle does not depend on the rest of the surface.
    MeshAttributes onto(const SurfaceMesh& surface, const Parallel& parallel) const;

    /// The same, faster if most boundary triangles have the same rest positions in
    /// `before`, for which this transfer has returned `known`.
    MeshAttributes onto(const SurfaceMesh& surface, const Parallel& parallel, const SurfaceMesh& before,
                        const MeshAttributes& known) const;

    const MeshAttributes& input_attributes() const { return attributes_; }

  private:
    /// Returns the defaults: the materials, and every triangle as a cut or as a boundary
    /// triangle without an input triangle.
    MeshAttributes prepared(const SurfaceMesh& surface, std::int32_t& cut) const;
    void interpolate(const std::array<Vec3, 3>& rest, std::size_t to, MeshAttributes& out,
                     std::uint32_t& guess) const;

    std::vector<Triangle> triangles_;  // of the input
    MeshAttributes attributes_;
    std::vector<std::int32_t> charts_;  // per input triangle; empty without texture coordinates and colours
    NearestPoint nearest_;
    double side_tolerance_;  // m
    double side_ = 1;        // -1: the input is oriented inward
};

}  // namespace splitcubes::geometry
