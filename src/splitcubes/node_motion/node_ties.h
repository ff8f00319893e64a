// Resolves cuts by blades that pass exactly through grid nodes.
#pragma once

#include <splitcubes/cutting/sweep.h>
#include <splitcubes/splitting/node_grid.h>

#include <vector>

namespace splitcubes::body {

/// Removes redundant cuts at nodes through which a blade passes. Such a blade hits every edge at the node and
/// would cut it off from both sides. If all uncut edges across the cut are hit at the node, the node is
/// assigned to one side: edges to the other side stay cut, edges to its own side and edges between two such
/// nodes that lie in the cut are not cut. If one of the edges is not hit, nothing is changed, so that no
/// ligament is left.
///
/// cuts: of one interval, with ids of splitting::edge_id; their order is kept.
void resolve_node_ties(const splitting::NodeGrid& grid, std::vector<cutting::EdgeCut>& cuts);

}  // namespace splitcubes::body
