// Pieces of a body inside a closed mesh.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/splitting/pieces.h>

#include <cstdint>
#include <vector>

namespace splitcubes::splitting {

enum class Enclosure : std::uint8_t { outside, inside, both };

/// Classifies each piece by its nodes. A node is inside if the mesh's winding number there is not zero (see
/// geometry::node_windings: decided exactly at every node). The mesh must be closed (MeshCheck::closed after
/// welding equal vertices); it may intersect itself and be inside out.
///
/// After cut_with_sheet with the same mesh no piece is on both sides, whatever was cut before or since: along
/// a grid edge the winding number changes only at the crossings that cut_with_sheet cuts. So both ends of an
/// uncut edge agree, an edge that another sheet cut first is cut anyway, and a piece is connected over uncut
/// edges.
///
/// Throws InputError if a position is not finite or an index is out of range.
std::vector<Enclosure> enclosure_of_pieces(const NodeGrid& grid, const Pieces& pieces,
                                           const geometry::TriangleMesh& closed);

}  // namespace splitcubes::splitting
