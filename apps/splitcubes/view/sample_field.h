// A quantity of the elastic samples at the vertices of a surface.
#pragma once

#include "published_state.h"

#include <array>
#include <cstdint>
#include <vector>

namespace splitcubes::view {

/// Interpolates in rest space, within pieces, by the inverse square of the distance to the nearest samples.
class SampleField {
  public:
    /// Values of the samples; see SampleState.
    static const std::vector<float>& values(const SampleState& samples, Field field);
    /// Interpolates to all vertex slots; weights are made again after a change of the surface.
    std::vector<float> at_vertices(const SurfaceView& surface, const SampleState& samples, Field field);

  private:
    static constexpr std::size_t neighbour_count = 4;
    struct Weights {
        std::array<std::uint32_t, neighbour_count> samples{};
        std::array<float, neighbour_count> shares{};
    };
    void find_weights(const SurfaceView& surface, const SampleState& samples);

    std::vector<Weights> weights_;
    std::uint64_t revision_ = 0;
    std::size_t sample_count_ = 0;
};

}  // namespace splitcubes::view
