// Treatment of pieces after a split: each gets enough phyxels to span space, or becomes rigid.
#pragma once

#include <cstdint>
#include <span>

namespace splitcubes::splitting {
class Surface;
}

namespace splitcubes::body {

class NodeTracker;
struct ElasticSamples;
struct SampleContext;
struct TopologyChange;

/// Gives each piece of the splits of this step enough phyxels to span space or makes it rigid. A split of a
/// piece from itself stands for a part of the input without phyxels. Mass is lumped
/// again from the nodes; momenta are conserved. surface: after the split. tracker: its kernels are those
/// before it. held: per phyxel of the last step, 1 if its position was prescribed. Sets change.new_phyxels,
/// volumes_changed and dirty_pairs.
void resample(const SampleContext& context, const splitting::Surface& surface, const NodeTracker& tracker,
              std::span<const std::uint8_t> held, ElasticSamples& samples, TopologyChange& change);

}  // namespace splitcubes::body
