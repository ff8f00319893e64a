// What must hold of a grid and its surface, checked from nothing: slow, for
// tests, debug builds and the command line.
#pragma once

#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/surface.h>

#include <string>
#include <vector>

namespace splitcubes::splitting {

/// One line per violation, at most `limit`; empty: all holds.
/// Grid: an edge between inside and outside is cut, between two outside nodes not,
/// boundary crossings only where they belong, parameters and normals in range.
std::vector<std::string> validate(const NodeGrid& grid, std::size_t limit = 10);

/// Surface: equal, vertex for vertex, to one built from nothing; closed, oriented,
/// manifold; each vertex carried by nodes of one piece with weights that sum to one.
std::vector<std::string> validate(const NodeGrid& grid, const Surface& surface, const Pieces& pieces,
                                  std::size_t limit = 10);

/// The quads in an order and with vertex names that do not depend on history:
/// equal texts mean equal surfaces, to the last bit of every position.
std::vector<std::array<std::uint64_t, 16>> canonical_quads(const Surface& surface);

}  // namespace splitcubes::splitting
