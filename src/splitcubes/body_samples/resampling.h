// Treatment of pieces after a split: each gets enough phyxels to span space, or becomes rigid.
#pragma once

#include <splitcubes/math/types.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace splitcubes::splitting {
class Surface;
}

namespace splitcubes::body {

class NodeTracker;
struct ElasticSamples;
struct SampleContext;
struct TopologyChange;

/// The holds and handles of a body.
struct Attachments {
    std::span<const std::uint8_t> held;  // per phyxel of the last step, 1 if its position was prescribed
    std::size_t holds = 0, handles = 0;
    /// Return whether one of them, active or not, acts on a phyxel.
    std::function<bool(std::size_t phyxel)> hold_acts_on = [](std::size_t) { return true; };
    std::function<bool(std::size_t phyxel)> handle_acts_on = [](std::size_t) { return true; };
    /// Returns how far, m, active holds put a rest point from a position in the world, m; 0 if none acts.
    std::function<double(const Vec3& rest, const Vec3& position)> hold_offset = [](const Vec3&, const Vec3&) {
        return 0.0;
    };
};

/// Gives each piece of the splits of this step enough phyxels to span space or makes it rigid. A split of a
/// piece from itself stands for a part of the input without phyxels, for one with gaps, which get phyxels, or
/// for one of change.fast_fragments, which become rigid. Mass is lumped again from the nodes; momenta are
/// conserved. surface: after the split. tracker: its kernels are those before it. New phyxels ignore all
/// holds if none acts on a phyxel of their piece or, where it has none, of the pieces that were one before
/// the split: a hold does not catch what moved without it. The same goes for handles, and for what is far
/// from where holds would put it. Sets change.new_phyxels, volumes_changed and dirty_pairs.
void resample(const SampleContext& context, const splitting::Surface& surface, const NodeTracker& tracker,
              const Attachments& attachments, ElasticSamples& samples, TopologyChange& change);

}  // namespace splitcubes::body
