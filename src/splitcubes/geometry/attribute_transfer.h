// Texture coordinates, colours and materials from a mesh to a resampled surface of it.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/nearest_point.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace splitcubes::geometry {

/// Names of the materials that a transfer adds.
inline constexpr const char* boundary_material = "boundary";
inline constexpr const char* cut_material = "cut";

/// Base colours, linear, of faces that have none of the input's.
inline constexpr Rgba boundary_colour{0.72F, 0.66F, 0.58F, 1.0F};
inline constexpr Rgba cut_colour{0.75F, 0.13F, 0.11F, 1.0F};

/// Materials `boundary` and `cut` by the triangles' origin: for a surface that has no
/// attributes and stands beside one that has.
MeshAttributes attributes_by_origin(const SurfaceMesh& surface);

/// Carries the attributes of one input mesh over, in rest space.
///
/// A triangle of origin boundary goes with the input triangle that is nearest to
/// its centroid: it takes its material, and each of its corners the texture
/// coordinate and colour of the point nearest to it within that triangle's chart
/// (see attribute_charts). So no triangle spans a seam; the seams of the result
/// run along its own edges, within about a cell of the input's.
///
/// A triangle of origin cut gets the material `cut` (the input's own, if it has
/// one of that name), texture coordinates (0, 0), and where there are colours the
/// cut's colour. Boundary triangles whose input triangle has no material get one
/// named `boundary`. Both are appended to the input's materials where needed.
class AttributeTransfer {
  public:
    /// input: at rest; attributes: of its triangles. side_tolerance: an input
    /// triangle that faces away from the surface's triangle counts as further away
    /// by this (m), so that a thin wall does not take the other side's colour; half
    /// a cell is a good value. O(n log n).
    AttributeTransfer(const TriangleMesh& input, MeshAttributes attributes, double side_tolerance);

    /// Attributes for the surface's triangles; empty where the input has none.
    /// Goes by surface.rest, or by the positions where that is empty. The same bits
    /// for any number of threads; each triangle's share depends on nothing else of the surface.
    MeshAttributes onto(const SurfaceMesh& surface, const Parallel& parallel) const;

    /// The same, faster where most boundary triangles stand at the same place at rest
    /// in `before`, for which this transfer has made `known`.
    MeshAttributes onto(const SurfaceMesh& surface, const Parallel& parallel, const SurfaceMesh& before,
                        const MeshAttributes& known) const;

    const MeshAttributes& input_attributes() const { return attributes_; }

  private:
    /// What stands there before a triangle's share is found: the materials, and every
    /// triangle as if it were cut or had nothing near.
    MeshAttributes prepared(const SurfaceMesh& surface, std::int32_t& cut) const;
    void carry(const std::array<Vec3, 3>& rest, std::size_t to, MeshAttributes& out,
               std::uint32_t& guess) const;

    std::vector<Triangle> triangles_;  // of the input
    MeshAttributes attributes_;
    std::vector<std::int32_t> charts_;  // per input triangle; empty where a corner has no values
    NearestPoint nearest_;
    double side_tolerance_;  // m
    double side_ = 1;        // -1: the input is inside out
};

}  // namespace splitcubes::geometry
