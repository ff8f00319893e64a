// Ligaments: small groups of phyxels that see no other phyxel of their piece although uncut grid edges
// connect them to it around the occluders. Without bridging links they would fly off.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace splitcubes::splitting {
class NodeGrid;
}

namespace splitcubes::body {

struct ElasticSamples;
struct TopologyChange;

/// Makes pairs between ligaments and the rest of their piece visible where a short path through the material
/// connects them, and adds these pairs to change.dirty_pairs. reevaluated: pairs whose visibility may have
/// changed in this step.
void bridge_ligaments(const splitting::NodeGrid& grid, std::size_t piece_count, ElasticSamples& samples,
                      std::span<const std::uint32_t> reevaluated, TopologyChange& change);

}  // namespace splitcubes::body
