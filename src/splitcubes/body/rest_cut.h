// Cuts a body at rest, which does not move, with a blade on its path.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/cutting/blade.h>
#include <splitcubes/cutting/sweep.h>
#include <splitcubes/splitting/crossed_edges.h>
#include <splitcubes/splitting/node_grid.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Cuts every uncut edge between two inside nodes that the blade crosses while it
/// is active; the blade's world is the grid's rest space. Returns the slots of the
/// edges that were cut, in the order in which the blade got to them span by span
/// (between two keyframes), by edge_id within one. Of an edge that it crosses more
/// than once the first crossing counts.
///
/// The whole path is swept, so nothing depends on time steps; keyframes more on
/// the same straight way change crossings by no more than rounding. Work and
/// memory go with what the blade sweeps within the grid, not with the grid.
///
/// stop: asked before each span; where it returns true no more is cut.
std::vector<std::int32_t> cut_with_blade(splitting::NodeGrid& grid, const cutting::Blade& blade,
                                         std::int32_t cut_number, const Parallel& parallel,
                                         const std::function<bool()>& stop = {});

/// Appends edge_id of the edges with an inside end, cut or not, that a blade crosses which sweeps
/// this, consecutive parts of one interval, in the grid's rest space.
void append_edges_crossed(const splitting::NodeGrid& grid, std::span<const cutting::SweptBlade> swept,
                          const Parallel& parallel, std::vector<std::uint64_t>& ids);

/// The edges of the body that the blade crosses while it is active.
splitting::CrossedEdges edges_crossed_by_blade(const splitting::NodeGrid& grid, const cutting::Blade& blade,
                                               const Parallel& parallel);

/// Of edge_id, each counted once; `ids` is sorted.
splitting::CrossedEdges crossed_edges(const splitting::NodeGrid& grid, std::vector<std::uint64_t>& ids);

}  // namespace splitcubes::body
