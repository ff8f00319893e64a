// Pieces of few nodes, found without a labelling of the whole grid.
#pragma once

#include <splitcubes/splitting/node_grid.h>

#include <functional>
#include <vector>

namespace splitcubes::splitting {

/// Collects the nodes of the piece that contains `start`, over whole edges. Ends early and returns false once
/// there are more than `limit`, or once is_large(node) says that a node belongs to such a piece; `nodes` then
/// holds some of them.
bool collect_small_piece(const NodeGrid& grid, const Vec3i& start, std::size_t limit,
                         const std::function<bool(const Vec3i&)>& is_large, std::vector<Vec3i>& nodes);

}  // namespace splitcubes::splitting
