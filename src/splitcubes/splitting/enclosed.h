// Which pieces of a body lie inside a closed mesh.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/splitting/pieces.h>

#include <cstdint>
#include <vector>

namespace splitcubes::splitting {

enum class Enclosure : std::uint8_t { outside, inside, both };

/// Where each piece lies: inside are the nodes that the mesh winds round (winding
/// number not zero, see geometry::node_windings: decided exactly, at every node).
/// The mesh must be closed (MeshCheck::closed once equal vertices are welded); it
/// may intersect itself and be inside out.
///
/// After cut_with_sheet with the same mesh no piece is on both sides, whatever was
/// cut before or since. For the winding number changes along a grid edge only
/// where the mesh crosses it, by the very crossings that cut_with_sheet cuts; so
/// the two ends of an edge that is still uncut agree, an edge that was cut by
/// another sheet is cut all the same, and a piece is held together by uncut edges.
///
/// Throws InputError where a position is not finite or an index out of range.
std::vector<Enclosure> enclosure_of_pieces(const NodeGrid& grid, const Pieces& pieces,
                                           const geometry::TriangleMesh& closed);

}  // namespace splitcubes::splitting
