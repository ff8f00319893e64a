// Blades that pass through grid nodes themselves.
#pragma once

#include <splitcubes/cutting/sweep.h>
#include <splitcubes/splitting/node_grid.h>

#include <vector>

namespace splitcubes::body {

/// What a blade meets at a node it meets on every edge there, and so it would cut the
/// node off from both sides. Where all uncut edges of a node that lead across the cut
/// are hit at the node, the node goes to one side: the edges to the other stay
/// cut, those to its own do not, nor those between two such nodes that lie in the
/// cut. Where one of them is not hit nothing is changed, so that no strand is left.
///
/// cuts: of one interval, ids those of splitting::edge_id; the order is kept.
void settle_node_ties(const splitting::NodeGrid& grid, std::vector<cutting::EdgeCut>& cuts);

}  // namespace splitcubes::body
