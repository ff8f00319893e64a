// Tearing and fracture: cuts the grid edges at which the stress exceeds the strength of the material. The
// paper mentions tearing (sections 1 and 6.3) but no criterion; here it is the largest principal stress
// (Rankine), and a crack grows as a sheet.
#pragma once

#include <splitcubes/body/node_tracker.h>
#include <splitcubes/body/tear_settings.h>
#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/occluder_grid.h>
#include <splitcubes/meshless/locator.h>
#include <splitcubes/meshless/material.h>
#include <splitcubes/meshless/neighbourhoods.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/slot_map.h>

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

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
};

/// Cracks of one body.
///
/// Stress. The stress of an edge is the mean over its two nodes. The stress of a node is the kernel mean of
/// the Cauchy stresses P F^T / det F of the phyxels that influence it: those of its piece that are in reach
/// and visible. Phyxels that are held, inverted, or of lower rank than initially are excluded. An edge with
/// more weight on held phyxels than on the others does not tear.
///
/// Initiation. A crack begins at the uncut edge with the largest ratio of stress to strength, if that is
/// above 1, in the plane normal to the principal direction, which must be within 45 degrees of the deformed
/// edge. No crack begins within one support radius of a nearly parallel crack, because the samples could not
/// resolve both; this distance shrinks to zero as the ratio grows from 1 to 2. Cracks that begin in one step
/// are at least as far apart as a pressure wave travels in it, since closer ones would have relieved each
/// other.
///
/// Propagation. A crack grows cell by cell across the edges around its front where the stress is above
/// propagation_ratio * strength and opens it (within 60 degrees). Its plane is turned towards that of the
/// stress; so it is a sheet. If the strength varies within a few cells and is lowest along a plane that the
/// stress opens (a weak plane), the crack turns into that plane. In one step it grows as far as crack_speed
/// allows, under the stress at the start of the step. Edges that a crack has passed on all sides, or that
/// connect two cracks side by side, are cut too: the samples on both sides no longer see each other, so no
/// force would act across.
///
/// Crack opening. If few phyxels are left ahead of a tip, as in a bent plate of two layers, they are excluded
/// or are not loaded by the crack. Therefore a crack in an elastic material also grows if its opening equals
/// that under the full strength ahead (linear elastic fracture mechanics). From four times that on it may
/// also split off a slab of one or two nodes beside another crack.
///
/// Ligaments. An edge that still connects the crack faces, its ends being influenced by samples that do not
/// see each other, is cut when it is stretched far more than any stress below the strength could.
///
/// Pieces that are too small to resolve a stress field do not tear.
class Tearing {
  public:
    /// The settings must have been checked; phyxels and neighbourhoods must be those before any cut.
    Tearing(const TearSettings& settings, const meshless::Material& material, const splitting::NodeGrid& grid,
            const meshless::Phyxels& phyxels, const meshless::Neighbourhoods& neighbourhoods);

    /// Cuts the edges that tear and returns their slots. Takes O(phyxels) if no stress is near the strength.
    std::vector<std::int32_t> tear(splitting::NodeGrid& grid, const TearContext& context);

    /// Largest ratio of smoothed principal stress to strength over the phyxels, as of the last call of tear;
    /// 0 if it was below four fifths of propagation_ratio.
    double top_load() const { return top_load_; }

  private:
    struct Stress {
        double largest = 0;             // Pa, largest principal stress
        Vec3 direction = Vec3::Zero();  // of it; unit, world; zero: not computed
        Mat3 world_from_rest = Mat3::Identity();
    };
    /// Edge that may be cut.
    struct Proposal {
        std::uint64_t id = no_edge;
        double load = 0;  // stress over strength
        double parameter = 0;
        Vec3 normal = Vec3::Zero();
        double crack_opening = 0;  // stress that the opening implies ahead of the tip, over the strength
    };
    static constexpr std::uint64_t no_edge = ~std::uint64_t{0};
    /// Smoothed load of a phyxel, over propagation_ratio, from which on edges around it are examined. Below
    /// 1, since an edge can be loaded more than the phyxels around it; lower costs time.
    static constexpr double min_load = 0.8;
    /// Cosine of 60 degrees: largest angle between the planes of one crack, and between a crack's normal and
    /// the principal direction where the crack grows.
    static constexpr double min_opening_cosine = 0.5;
    /// Edge lengths beyond its ends in which a plane still counts as crossing an edge. Planes of one crack
    /// differ by about as much; an edge that all of them miss would stay as a ligament.
    static constexpr double edge_slack = 0.1;
    /// Stress implied by the crack opening, over the strength, from which on a crack may split off a slab.
    static constexpr double slab_opening = 4;
    /// Kernel means over the phyxels around a node or an edge.
    struct StressSum {
        Mat3 stress = Mat3::Zero();  // Pa, weighted sum over the phyxels that are not excluded
        double total = 0;            // weight of these
        double held = 0;             // weight of held phyxels

        StressSum operator+(const StressSum& other) const {
            return {stress + other.stress, total + other.total, held + other.held};
        }
    };
    struct NodeStress {
        std::uint64_t step = 0;  // step_ for which it is valid
        StressSum sum;
    };
    /// An edge of a crack cell that was uncut when the cell was registered.
    struct OpenEdge {
        splitting::GridEdge edge;
        double stretch = 0;                   // as of the last step; negative: cut
        std::int32_t lower = -1, upper = -1;  // tracker indices of its nodes; -1: not known
        std::uint64_t queried_epoch = 0;      // epoch_ of the last query
        // In that query: the crack cells that may cut it, in their order.
        std::uint32_t tip_count = 0;
        std::array<std::uint32_t, 4> tips{};
        std::uint8_t shielding = 0;  // bits of Tip::shielding that are set for all of them
    };
    /// Node of an edge at which a crack may begin.
    struct StartNode {
        Vec3i node;
        std::int32_t index;  // tracker index, or -1
        StressSum sum;
    };
    /// Edge at which a crack may begin.
    struct StartEdge {
        splitting::GridEdge edge;
        std::uint32_t lower, upper;  // start nodes
        Vec3 rest = Vec3::Zero();    // m, its middle
        double strength = 0;         // Pa
        Stress stress;               // zero if it is below the strength
    };
    struct WeakPlane {
        Vec3 point, normal;  // m, unit; rest space
    };
    /// A crack in a cell and its possible continuation.
    struct Tip {
        Vec3 centre = Vec3::Zero(), normal = Vec3::Zero();  // mean of the cell's cuts; m, unit; rest space
        std::optional<WeakPlane> weak_plane;
        std::uint32_t edges = 0;  // bit e: edge e is uncut and within reach of the crack's plane
        // Per edge: the crossings on its grid line that shield it from being cut (bits of along_line),
        // whatever plane this tip proposes, unless the crack is wide open.
        std::array<std::uint8_t, splitting::edge_count> shielding{};
        std::array<std::int32_t, splitting::edge_count>
            open{};  // per edge of `edges`: index of its open edge
    };
    /// The two crack faces on a cut edge.
    struct CrackFaces {
        std::int32_t lower = -1, upper = -1;  // tracker indices of its nodes; -1: not known
        std::int32_t edge = 0;                // of the cell
        double parameter = 0;                 // along the edge
    };
    using Key = std::array<int, 3>;
    /// A cell with an edge that has been cut (not by the boundary).
    struct CrackCell {
        Key cell{};
        bool is_stale = true;  // an edge of it, or one that shields, was cut since the tip was computed
        std::uint64_t touched_epoch = 0;  // epoch_ in which touched_cells_ held it
        double opening_stress = 0;        // Pa, stress ahead of the tip that the crack opening implies
        Tip tip;
        std::uint32_t crack_face_count = 0;
        std::array<CrackFaces, splitting::edge_count> crack_faces{};
    };
    struct KeyHash {
        std::size_t operator()(const Key& key) const {
            return static_cast<std::size_t>(key[0]) * 73856093U ^
                   static_cast<std::size_t>(key[1]) * 19349663U ^
                   static_cast<std::size_t>(key[2]) * 83492791U;
        }
    };

    double strength_at(const Vec3& rest) const;
    void note_crossings(const splitting::NodeGrid& grid);
    void note_crossing_beside(const splitting::NodeGrid& grid, const Key& cell, bool is_own);
    void note_crack_points(const splitting::NodeGrid& grid);
    void note_open_edges(const splitting::NodeGrid& grid, const Key& cell);
    void forget_cut_edges();
    void find_min_strengths(const splitting::NodeGrid& grid, const TearContext& context);
    void measure_phyxel(const TearContext& context, std::size_t i, double threshold);
    double measure_phyxels(const TearContext& context, double threshold);
    /// Returns the lowest principal stress, Pa, that can contribute to tearing anywhere.
    double min_stress() const {
        return min_load * settings_.propagation_ratio * settings_.strength * min_strength_factor_;
    }
    void find_loads(const TearContext& context);
    void bound_principal_stress(const TearContext& context, double threshold);
    double load_of(const TearContext& context, std::size_t i) const;
    template <class Use>
    double for_influences(const TearContext& context, const splitting::NodeGrid& grid, const Vec3i& node,
                          std::int32_t index, const Use& use) const;
    StressSum sum_stress(const TearContext& context, const splitting::NodeGrid& grid, const Vec3i& node,
                         std::int32_t index) const;
    StressSum stress_at(const TearContext& context, const splitting::NodeGrid& grid, const Vec3i& node,
                        std::int32_t index) const;
    static bool has_kernel(const TearContext& context, std::int32_t index);
    void request_stress(const TearContext& context, std::int32_t index);
    void find_requested_stresses(const TearContext& context, const splitting::NodeGrid& grid);
    Stress find_stress(const TearContext& context, const splitting::NodeGrid& grid,
                       const splitting::GridEdge& edge, const std::array<std::int32_t, 2>& nodes,
                       const StressSum& sum, double threshold) const;
    Mat3 gradient_at(const TearContext& context, const splitting::NodeGrid& grid,
                     const splitting::GridEdge& edge, const std::array<std::int32_t, 2>& nodes) const;
    bool is_large(const TearContext& context, std::int32_t piece) const;
    static bool is_uncut(const splitting::NodeGrid& grid, const splitting::GridEdge& edge);
    bool is_shielded(const splitting::NodeGrid& grid, const splitting::GridEdge& edge,
                     const Vec3& normal) const;
    bool is_beside_crack(const Vec3& rest, const Vec3& rest_normal, double load) const;
    std::optional<WeakPlane> weak_plane_at(const Vec3& rest) const;
    void break_ligaments(splitting::NodeGrid& grid, const TearContext& context,
                         std::vector<std::int32_t>& slots);
    bool is_first_around(const splitting::NodeGrid& grid, const splitting::GridEdge& edge,
                         const Key& key) const;
    std::uint32_t passed_edges_in(const splitting::NodeGrid& grid, const TearContext& context,
                                  const Key& key) const;
    void cut_passed_edges(splitting::NodeGrid& grid, const TearContext& context,
                          std::vector<std::int32_t>& slots);
    Tip tip_of(const splitting::NodeGrid& grid, CrackCell& cell) const;
    static const geometry::Frame* frame_of(const TearContext& context, const Vec3i& node,
                                           std::int32_t& index);
    double opening_stress(const TearContext& context, CrackCell& cell) const;
    bool list_near_phyxels(const splitting::NodeGrid& grid, const TearContext& context);
    /// Calls use for the phyxels near a cell; see PhyxelLocator::visit.
    template <class Use>
    static bool visit_near(const splitting::NodeGrid& grid, const TearContext& context, const Key& cell,
                           const Use& use) {
        const double size = grid.rest().cell_size;
        const Vec3 low = grid.rest().node_position({cell[0], cell[1], cell[2]});
        return context.locator.visit(low + Vec3::Constant(0.5 * size), 1.5 * context.spacing, use);
    }
    std::uint8_t certain_shielding(const splitting::NodeGrid& grid, const Tip& tip,
                                   const splitting::GridEdge& edge) const;
    static bool may_meet(const Tip& tip, const Vec3& a, const Vec3& b);
    bool propose(const splitting::NodeGrid& grid, const CrackCell& cell, const Stress& stress,
                 double strength, const splitting::GridEdge& edge, Proposal& out) const;
    Proposal propose(const splitting::NodeGrid& grid, const TearContext& context, const OpenEdge& open) const;
    void list_front_edges(const splitting::NodeGrid& grid, const TearContext& context);
    void find_proposals(const splitting::NodeGrid& grid, const TearContext& context);
    static void cells_of(const splitting::NodeGrid& grid, std::span<const std::int32_t> slots,
                         std::vector<Key>& out);
    void grow(splitting::NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots);
    void find_loaded_front(const splitting::NodeGrid& grid, const TearContext& context);
    /// Calls use(cell) for the cells that share an edge.
    template <class Use>
    static void for_cells_around(const splitting::NodeGrid& grid, const splitting::GridEdge& edge,
                                 const Use& use) {
        for (int k = 0; k < 4; ++k) {
            Vec3i cell = edge.node;
            cell[(edge.axis + 1) % 3] -= k & 1;
            cell[(edge.axis + 2) % 3] -= k >> 1;
            if (grid.has_cell(cell)) use(Key{cell[0], cell[1], cell[2]});
        }
    }
    void list_starts(const splitting::NodeGrid& grid, const TearContext& context, std::uint32_t phyxel);
    void consider_start(const splitting::NodeGrid& grid, std::uint32_t phyxel, const StartEdge& start,
                        Proposal& best) const;
    bool begin_crack_at(splitting::NodeGrid& grid, const TearContext& context, std::uint32_t phyxel,
                        std::vector<std::int32_t>& slots);
    void begin_cracks(splitting::NodeGrid& grid, const TearContext& context,
                      std::vector<std::int32_t>& slots);
    std::int32_t cut(splitting::NodeGrid& grid, const Proposal& proposal, std::vector<std::int32_t>& slots);

    TearSettings settings_;
    double wave_speed_ = 0;           // m/s, of pressure waves
    double crack_speed_ = 0;          // m/s
    double min_strength_factor_ = 1;  // minimum of strength_factor over the nodes
    double cell_size_ = 0;            // m
    double opening_modulus_ = 0;  // Pa/m, stress ahead of a tip over crack opening behind it; 0: not elastic
    double break_stretch_ = 2;    // stretch at which an edge beside a crack is cut
    double top_load_ = 0;

    std::vector<std::uint8_t> own_rank_;  // per phyxel, rank of its neighbourhood before any cut, at least 2
    std::vector<double> min_strength_;    // per phyxel, Pa, minimum strength at the nodes around it
    std::vector<Mat3> stress_;            // per phyxel, Pa, Cauchy; zero: excluded
    std::vector<double> stress_norm_;     // per phyxel, Pa, Frobenius norm of it; negative: excluded
    std::vector<double> principal_;  // per phyxel, Pa, upper bound of its principal stresses; -inf: excluded
    std::vector<std::uint8_t>
        is_strained_;                    // per phyxel, bits: it, or a neighbour, may be above min_stress()
    std::vector<double> chunk_largest_;  // per chunk, Pa, maximum of stress_norm_
    std::vector<double> load_;  // per phyxel, smoothed stress over the minimum strength; 0: below min_load
    std::vector<std::size_t> phyxels_of_;         // per piece, its number of phyxels
    double reach_ = 0;                            // m, the largest support radius
    std::vector<NodeStress> node_stress_;         // per tracked node; valid in this step if it was requested
    std::vector<std::uint32_t> requested_nodes_;  // tracked nodes whose stress is requested
    std::uint64_t step_ = 0, epoch_ = 0;          // calls that examined edges; passes over crack cells
    // Around one phyxel. The last one: per node in a box around it, index in start_nodes_ or -1.
    std::vector<StartNode> start_nodes_;
    std::vector<StartEdge> starts_;
    std::vector<std::int32_t> start_indices_;
    std::vector<std::uint32_t> front_edges_;   // open edges of the front
    std::vector<Proposal> proposals_;          // edges to cut now
    std::vector<std::uint32_t> front_;         // crack cells from which cracks may grow
    std::vector<Key> touched_cells_;           // cells around edges cut in this step
    std::vector<Key> separated_nodes_;         // nodes at which a ligament was cut in this step
    std::vector<std::uint32_t> passed_edges_;  // per touched cell, bit e: edge e is to be cut
    std::vector<std::uint32_t> order_;         // phyxels loaded above their strength, the most loaded first

    std::size_t known_crossings_ = 0, known_points_ = 0;  // crossings of the grid that are registered
    std::vector<CrackCell> crack_cells_;                  // in order of registration
    splitting::SlotMap<1> crack_cell_index_;              // index of these, per cell of the grid
    // Phyxels near crack cell k: near_[first_near_[k]] up to near_[first_near_[k + 1]], valid while there are
    // phyxels_known_ phyxels.
    std::vector<std::uint32_t> near_, first_near_;
    std::size_t phyxels_known_ = 0;
    std::vector<std::uint8_t> is_loaded_;    // per crack cell, in this step
    std::vector<OpenEdge> open_edges_;       // of the crack cells, each once; some may have been cut since
    splitting::SlotMap<3> open_edge_index_;  // index of these, per edge of the grid
    struct CrackPoint {
        Vec3 rest, normal;
    };
    std::unordered_map<Key, std::vector<CrackPoint>, KeyHash> crack_points_;  // by cubes of side cube_
    double cube_ = 0;                                                         // m
    std::vector<Vec3> new_tears_;  // m, rest; crossings torn in this step
};

}  // namespace splitcubes::body
