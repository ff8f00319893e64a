// Ligaments: phyxels on both sides that do not see each other although uncut grid edges connect them around
// the occluders. Without bridging links the parts of the piece would fly apart.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::splitting {
class NodeGrid;
}

namespace splitcubes::body {

struct ElasticSamples;
struct TopologyChange;

/// Returns the groups, each ascending, that visible pairs connect to none of the others among the given
/// phyxels of their elastic piece. The largest group of a piece, or one of the large ones, is not among them.
/// The cost grows with the small groups and with the distance of the phyxels along the pairs.
std::vector<std::vector<std::uint32_t>> separate_groups(const ElasticSamples& samples,
                                                        std::size_t piece_count,
                                                        std::span<const std::uint32_t> phyxels);

/// Connects the groups into which visible pairs divide a piece: makes pairs between a group and the rest of
/// its piece visible where the shortest paths through the material lead from one to the other, and adds them
/// to change.dirty_pairs. Where there is no such pair, adds a gap to change.gaps. Adds each group to
/// change.rejoined. phyxels: those that lost or gained a pair, and those that are known to be in separate
/// groups.
void bridge_ligaments(const splitting::NodeGrid& grid, std::size_t piece_count, ElasticSamples& samples,
                      std::span<const std::uint32_t> phyxels, TopologyChange& change);

}  // namespace splitcubes::body
