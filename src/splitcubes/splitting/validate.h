// Invariants of a grid and its surface, checked from scratch: slow; for tests, debug builds and the command
// line.
#pragma once

#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/surface.h>

#include <string>
#include <vector>

namespace splitcubes::splitting {

/// Returns one line per violation, at most `limit`; empty if there is none. Checks that an edge between
/// inside and outside nodes is cut by a crossing of the boundary, that one between two outside nodes is not
/// cut, and that parameters and normals are in range.
std::vector<std::string> validate(const NodeGrid& grid, std::size_t limit = 10);

/// Checks that the surface equals, vertex for vertex, one built from scratch; that it is closed, oriented and
/// manifold; and that each vertex is moved by nodes of one piece with weights that sum to one.
std::vector<std::string> validate(const NodeGrid& grid, const Surface& surface, const Pieces& pieces,
                                  std::size_t limit = 10);

/// Returns the quads in an order and with vertex names that do not depend on history: equal results mean
/// equal surfaces, to the last bit of every position.
std::vector<std::array<std::uint64_t, 16>> canonical_quads(const Surface& surface);

}  // namespace splitcubes::splitting
