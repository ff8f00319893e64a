// Stress of a body at its phyxels, grid nodes and grid edges, for tearing.
#pragma once

#include <splitcubes/fracture/strength_field.h>
#include <splitcubes/fracture/tear_context.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Kernel means over the phyxels around a node or an edge.
struct StressSum {
    Mat3 stress = Mat3::Zero();  // Pa, weighted sum over the phyxels that are not excluded
    double total = 0;            // weight of these
    double held = 0;             // weight of held phyxels

    StressSum operator+(const StressSum& other) const {
        return {stress + other.stress, total + other.total, held + other.held};
    }
};

/// Stress of a grid edge.
struct EdgeStress {
    double largest = 0;             // Pa, largest principal stress
    Vec3 direction = Vec3::Zero();  // of it; unit, world; zero: not computed
    Mat3 world_from_rest = Mat3::Identity();
};

/// Stress of one body, as Tearing defines it: that of the phyxels, their smoothed load (largest principal
/// stress over strength), and the kernel means at nodes and edges.
///
/// A step calls find_loads and, if a load is high enough, begin_nodes; then the stress of nodes and edges may
/// be queried.
class StressField {
  public:
    /// Phyxels and neighbourhoods must be those before any cut. The strength field must outlive this object.
    StressField(const StrengthField& strength, const meshless::Phyxels& phyxels,
                const meshless::Neighbourhoods& neighbourhoods);

    /// Computes the stress and the load of the phyxels and returns the largest load; 0 if no stress is near
    /// the strength. In that case the loads are those of an earlier step. Takes O(phyxels) then.
    double find_loads(const splitting::NodeGrid& grid, const TearContext& context);
    /// Invalidates the stress of all nodes and counts the phyxels of each piece.
    void begin_nodes(const TearContext& context);

    /// Load of a phyxel from which on edges around it are examined. It is below propagation_ratio, since an
    /// edge can be loaded more than the phyxels around it; lower costs time.
    double min_load() const { return min_load_share * strength_.settings().propagation_ratio; }
    /// Load per phyxel: smoothed stress over the minimum strength; 0: below min_load().
    std::span<const double> load() const { return load_; }
    /// Minimum strength at the nodes around each phyxel, Pa.
    std::span<const double> min_strength() const { return min_strength_; }
    /// Largest support radius of the phyxels before any cut, m.
    double reach() const { return reach_; }
    /// Returns whether a piece is large enough to resolve a stress field.
    bool is_large(const TearContext& context, std::int32_t piece) const;

    // Stress of nodes. index: tracker index of the node or -1.
    /// Requests the stress of a tracked node, to be computed once per step by find_requested_stresses.
    void request_stress(const TearContext& context, std::int32_t index);
    void find_requested_stresses(const TearContext& context, const splitting::NodeGrid& grid);
    /// Returns the stress sum of a node: the stored one if it is valid in this step, else computed.
    StressSum stress_at(const TearContext& context, const splitting::NodeGrid& grid, const Vec3i& node,
                        std::int32_t index) const;
    /// Stores the stress sum of a node for this step, if the node is tracked. Different nodes may be stored
    /// from different threads.
    void store_stress(const TearContext& context, std::int32_t index, const StressSum& sum);

    /// Returns the stress of an edge from the stress sum of its nodes; zero if the largest principal stress
    /// is below the threshold, Pa. nodes: tracker indices of the ends or -1.
    EdgeStress find_stress(const TearContext& context, const splitting::NodeGrid& grid,
                           const splitting::GridEdge& edge, const std::array<std::int32_t, 2>& nodes,
                           const StressSum& sum, double threshold) const;

  private:
    /// Smoothed load of a phyxel, over propagation_ratio; see min_load().
    static constexpr double min_load_share = 0.8;
    struct NodeStress {
        std::uint64_t step = 0;  // step_ for which it is valid
        StressSum sum;
    };

    void find_min_strengths(const splitting::NodeGrid& grid, const TearContext& context);
    void measure_phyxel(const TearContext& context, std::size_t i, double threshold);
    double measure_phyxels(const TearContext& context, double threshold);
    /// Returns the lowest principal stress, Pa, that can contribute to tearing anywhere.
    double min_stress() const {
        const TearSettings& settings = strength_.settings();
        return min_load_share * settings.propagation_ratio * settings.strength * strength_.min_factor();
    }
    void bound_principal_stress(const TearContext& context, double threshold);
    double load_of(const TearContext& context, std::size_t i) const;
    template <class Use>
    double for_influences(const TearContext& context, const splitting::NodeGrid& grid, const Vec3i& node,
                          std::int32_t index, const Use& use) const;
    StressSum sum_stress(const TearContext& context, const splitting::NodeGrid& grid, const Vec3i& node,
                         std::int32_t index) const;
    Mat3 gradient_at(const TearContext& context, const splitting::NodeGrid& grid,
                     const splitting::GridEdge& edge, const std::array<std::int32_t, 2>& nodes) const;

    const StrengthField& strength_;
    double reach_ = 0;                    // m, the largest support radius
    std::vector<std::uint8_t> own_rank_;  // per phyxel, rank of its neighbourhood before any cut, at least 2
    std::vector<double> min_strength_;    // per phyxel, Pa, minimum strength at the nodes around it
    std::vector<Mat3> stress_;            // per phyxel, Pa, Cauchy; zero: excluded
    std::vector<double> stress_norm_;     // per phyxel, Pa, Frobenius norm of it; negative: excluded
    std::vector<double> principal_;  // per phyxel, Pa, upper bound of its principal stresses; -inf: excluded
    std::vector<std::uint8_t>
        is_strained_;                    // per phyxel, bits: it, or a neighbour, may be above min_stress()
    std::vector<double> chunk_largest_;  // per chunk, Pa, maximum of stress_norm_
    std::vector<double> load_;  // per phyxel, smoothed stress over the minimum strength; 0: below min_load()
    std::vector<std::size_t> phyxels_of_;         // per piece, its number of phyxels
    std::vector<NodeStress> node_stress_;         // per tracked node; valid in this step if it was requested
    std::vector<std::uint32_t> requested_nodes_;  // tracked nodes whose stress is requested
    std::uint64_t step_ = 0;                      // calls of begin_nodes
};

}  // namespace splitcubes::body
