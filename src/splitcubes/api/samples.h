// The elastic samples of a body, for pictures of its strain and stress.
#pragma once

#include <splitcubes/api/types.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace splitcubes {

/// The elastic samples ("phyxels") of a body as they are now; arrays have one entry a sample. Samples are
/// only appended, so an index stays valid for the body's life.
struct SampleState {
    std::vector<Vector3> rest_positions;  ///< m, rest space
    std::vector<Vector3> positions;       ///< m, world
    std::vector<Vector3> velocities;      ///< m/s, world
    std::vector<double> masses;           ///< kg
    std::vector<std::int32_t> pieces;     ///< number of the sample's piece
    std::vector<float> von_mises_stress;  ///< Pa, of the Cauchy stress; 0 where it is inverted
    std::vector<float> pressure;          ///< Pa, mean over the sample's neighbourhood; positive: compressed
    std::vector<float> principal_stress;  ///< Pa, the largest of the Cauchy stress, with `pressure`
    std::vector<float> principal_strain;  ///< the largest stretch less 1
    double spacing = 0;                   ///< m, between samples at rest

    std::size_t size() const { return positions.size(); }  ///< number of samples
};

/// A pair of samples of one piece that carries forces.
struct SampleLink {
    std::uint32_t a = 0;   ///< index of a sample; see SampleState
    std::uint32_t b = 0;   ///< index of the other one
    float visibility = 1;  ///< share of the pair that cuts leave, 0 to 1: 1 nothing is between the two
};

}  // namespace splitcubes
