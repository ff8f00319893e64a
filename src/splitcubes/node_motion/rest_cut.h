// Cuts a body at rest with a blade along its path.
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

/// Cuts every uncut edge between two inside nodes that the blade crosses while it is active. Returns the
/// slots of the cut edges in the order of the spans (between two keyframes) in which they were cut, within a
/// span by edge_id. If the blade crosses an edge several times, the first crossing counts.
///
/// The whole path is swept, so the result does not depend on time steps; further keyframes on the same
/// straight path change crossings only by rounding. Work and memory are proportional to what the blade sweeps
/// within the grid, not to the grid.
///
/// stop: called before each span; cutting ends when it returns true. rest_from_world: moves what the blade
/// sweeps into rest space.
std::vector<std::int32_t> cut_with_blade(splitting::NodeGrid& grid, const cutting::Blade& blade,
                                         std::int32_t cut_number, const Parallel& parallel,
                                         const std::function<bool()>& stop = {},
                                         const Isometry& rest_from_world = Isometry::Identity());

/// Appends edge_id of the edges with an inside end, cut or not, that the swept blades cross. swept:
/// consecutive parts of one interval, in the grid's rest space.
void append_edges_crossed(const splitting::NodeGrid& grid, std::span<const cutting::SweptBlade> swept,
                          const Parallel& parallel, std::vector<std::uint64_t>& ids);

/// Returns counts of the body's edges that the blade crosses while it is active.
splitting::CrossedEdges edges_crossed_by_blade(const splitting::NodeGrid& grid, const cutting::Blade& blade,
                                               const Parallel& parallel);

/// Counts the edges with these edge_id, each once; sorts `ids`.
splitting::CrossedEdges crossed_edges(const splitting::NodeGrid& grid, std::vector<std::uint64_t>& ids);

}  // namespace splitcubes::body
