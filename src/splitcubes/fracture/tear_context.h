// The state of a body that its tearing reads in a step.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/occluder_grid.h>
#include <splitcubes/node_motion/node_tracker.h>
#include <splitcubes/samples/locator.h>
#include <splitcubes/samples/material.h>
#include <splitcubes/samples/neighbourhoods.h>
#include <splitcubes/splitting/pieces.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace splitcubes::body {

/// The state of a body that Tearing reads, as of the end of the last step.
struct TearContext {
    const splitting::Pieces& pieces;
    const geometry::OccluderGrid& occluders;
    const meshless::Phyxels& phyxels;
    const meshless::Neighbourhoods& neighbourhoods;
    const meshless::PhyxelLocator& locator;
    const meshless::Material& material;
    const NodeTracker& nodes;
    std::span<const geometry::Frame> frames;  // per tracked node
    std::span<const std::uint8_t> held;       // per phyxel, 1: its position is prescribed; or empty
    double spacing;                           // m, between phyxels
    double dt;                                // s
    const Parallel& parallel;

    /// Returns whether the tracker has the kernel of a node. index: its tracker index or -1.
    bool has_kernel(std::int32_t index) const {
        return index >= 0 && static_cast<std::size_t>(index) < nodes.kernels().size() &&
               nodes.is_awake(static_cast<std::uint32_t>(index));
    }
    /// Returns the frame of a node, or nullptr if the last step did not track it. index: tracker index of the
    /// node or -1; set if it is found.
    const geometry::Frame* frame_of(const Vec3i& node, std::int32_t& index) const {
        if (index < 0) index = nodes.find(node);
        if (index < 0 || !nodes.is_awake(static_cast<std::uint32_t>(index)) ||
            static_cast<std::size_t>(index) >= frames.size())
            return nullptr;
        return &frames[static_cast<std::size_t>(index)];
    }
};

}  // namespace splitcubes::body
