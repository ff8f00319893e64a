// Tearing and fracture: which grid edges part because the material cannot bear its
// stress. The paper names tearing (sections 1 and 6.3) and leaves its trigger open;
// here it is the largest principal stress (Rankine), and a crack grows as a sheet.
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

/// What Tearing reads of its body, as the last step left it.
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
/// The stress of an edge is the mean of those of its two nodes, and a node's the kernel mean of the Cauchy
/// stresses P F^T / det F of the phyxels that carry it: those of its piece that reach it and that it sees.
/// Phyxels that are held, inverted, or of less rank than at first have no say, and what
/// is mostly held does not tear.
///
/// A crack begins at the uncut edge with the largest stress relative to its strength,
/// where that is above 1, in the plane across the principal direction, which must be
/// within 45 degrees of the deformed edge. None begins within the support of a phyxel
/// of a crack that runs alongside, which the samples could not tell apart (the less, the
/// more the stress is above the strength: not at twice that); and those that begin in one step are as far
/// apart as a wave travels within it: nearer ones would have relieved each other.
///
/// A crack goes on, cell by cell around its edges, where the stress is above
/// toughness * strength and opens it (within 60 degrees), in its own plane turned
/// towards that of the stress; so it is a sheet. Where the strength varies over a few
/// cells and is least along a plane that the stress opens, a seam, it turns into
/// that. In one step it goes as far as
/// crack_speed allows, under the stress at the step's beginning. Edges that a crack has
/// passed on all sides, or that join two cracks which run side by side, part too: the
/// samples on both sides no longer see each other, so nothing could bear their load.
///
/// Where few phyxels are left ahead of a tip, as in a plate of two layers that is bent, they have no
/// say or take no stress from the crack. There a crack of an elastic material also goes on when its lips gape
/// as they would under the full strength ahead (linear elastic fracture mechanics), and from four
/// times that on it may also come off with a slab of a node or two beside another crack.
///
/// A strand that holds on all the same, its ends being carried by samples that do not see
/// each other, parts when its edge is stretched to much more than any stress that the
/// material bears.
///
/// Pieces too small to have a stress field do not tear.
class Tearing {
  public:
    /// Settings must have been checked; phyxels and neighbourhoods are those before any cut.
    Tearing(const TearSettings& settings, const meshless::Material& material, const splitting::NodeGrid& grid,
            const meshless::Phyxels& phyxels, const meshless::Neighbourhoods& neighbourhoods);

    /// Cuts what the stress tears; returns the new slots. O(phyxels) where nothing is
    /// near its strength.
    std::vector<std::int32_t> tear(splitting::NodeGrid& grid, const TearContext& context);

    /// Largest ratio of smoothed principal stress to strength at a phyxel, as of the
    /// last call of tear; 0 where it was below four fifths of the toughness.
    double top_load() const { return top_load_; }

  private:
    struct Stress {
        double largest = 0;             // Pa, of the principal stresses
        Vec3 direction = Vec3::Zero();  // unit, world; zero: no phyxel has a say
        Mat3 world_from_rest = Mat3::Identity();
    };
    struct Proposal {
        std::uint64_t id = no_edge;
        double load = 0;  // stress over strength
        double parameter = 0;
        Vec3 normal = Vec3::Zero();
        double crack_opening = 0;  // what the lips' gape stands for, over the strength
    };
    static constexpr std::uint64_t no_edge = ~std::uint64_t{0};
    /// Of a phyxel, in shares of the toughness, from which on cracks are looked for around it.
    static constexpr double min_load = 0.8;
    /// Of two planes that are of one crack, and of a crack's normal and the principal direction where it goes
    /// on: 60 degrees.
    static constexpr double min_opening_cosine = 0.5;
    /// How far beyond its ends an edge still counts as met, in edges: two planes of one crack differ by about
    /// so much, and an edge that both miss would stay as a strand.
    static constexpr double edge_slack = 0.1;
    /// Stress that a crack's gape stands for, over the strength, from which on it may come off with a slab.
    static constexpr double slab_opening = 4;
    /// Kernel sums over the phyxels that have a say.
    struct StressSum {
        Mat3 stress = Mat3::Zero();  // Pa
        double total = 0;            // share of what has a say
        double held = 0;             // share of what is held, and has none

        StressSum operator+(const StressSum& other) const {
            return {stress + other.stress, total + other.total, held + other.held};
        }
    };
    struct NodeStress {
        std::uint64_t step = 0;  // when it was found
        StressSum sum;
    };
    /// An uncut edge of a cell that a crack has come to.
    struct OpenEdge {
        splitting::GridEdge edge;
        double stretch = 0;                   // of the last step; negative: cut
        std::int32_t lower = -1, upper = -1;  // what the tracker calls its nodes, once it knows them
        std::uint64_t asked = 0;              // round
        // In that round: the crack's cells that ask, in their order.
        std::uint32_t tip_count = 0;
        std::array<std::uint32_t, 4> tips{};
        std::uint8_t shadows = 0;  // that are so for all of them
    };
    /// Where a crack may begin.
    struct StartNode {
        Vec3i place;
        std::int32_t index;  // what the tracker calls it, or -1
        StressSum sum;
    };
    struct StartEdge {
        splitting::GridEdge edge;
        std::uint32_t lower, upper;  // start nodes
        Vec3 rest = Vec3::Zero();    // m, its middle
        double strength = 0;         // Pa
        Stress stress;               // zero where it is too small to tear it
    };
    struct Plane {
        Vec3 point, normal;  // m, unit; rest space
    };
    /// A crack in a cell, and where it may go on.
    struct Tip {
        Vec3 centre = Vec3::Zero(), normal = Vec3::Zero();  // of what is cut; m, unit; rest space
        std::optional<Plane> weak_plane;
        std::uint32_t edges = 0;  // bit e: uncut, and the plane nearly meets it
        // Of each edge the crossings on its line that keep it from being cut, whichever plane this tip
        // proposes unless its lips gape wide.
        std::array<std::uint8_t, splitting::edge_count> shadows{};
        std::array<std::int32_t, splitting::edge_count> open{};  // of `edges`: which open edge it is
    };
    /// Of an edge that a crack has cut.
    struct CrackFaces {
        std::int32_t lower = -1, upper = -1;  // what the tracker calls its nodes, once it knows them
        std::int32_t edge = 0;                // of the cell
        double parameter = 0;                 // along it
    };
    using Key = std::array<int, 3>;
    /// A cell around an edge that was cut, not by the boundary.
    struct CrackCell {
        Key place{};
        bool is_stale = true;       // an edge of it has been cut since the tip was found
        std::uint64_t touched = 0;  // round of close_gaps
        double opening_stress = 0;  // Pa, what lips that gape so far mean ahead of the tip; of this round
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
    void find_weakest(const splitting::NodeGrid& grid, const TearContext& context);
    void measure_one(const TearContext& context, std::size_t i, double least);
    double measure_phyxels(const TearContext& context, double least);
    /// Pa, from which on a phyxel's stress matters to anyone.
    double min_stress() const {
        return min_load * settings_.propagation_ratio * settings_.strength * weakest_all_;
    }
    void find_loads(const TearContext& context);
    void bound_principal_stress(const TearContext& context, double least);
    double load_of(const TearContext& context, std::size_t i) const;
    template <class Use>
    double for_influences(const TearContext& context, const splitting::NodeGrid& grid, const Vec3i& node,
                          std::int32_t index, const Use& use) const;
    StressSum sum_stress(const TearContext& context, const splitting::NodeGrid& grid, const Vec3i& node,
                         std::int32_t index) const;
    StressSum stress_at(const TearContext& context, const splitting::NodeGrid& grid, const Vec3i& node,
                        std::int32_t index) const;
    static bool is_lattice_driven(const TearContext& context, std::int32_t index);
    void want_stress(const TearContext& context, std::int32_t index);
    void find_wanted(const TearContext& context, const splitting::NodeGrid& grid);
    Stress find_stress(const TearContext& context, const splitting::NodeGrid& grid,
                       const splitting::GridEdge& edge, const std::array<std::int32_t, 2>& nodes,
                       const StressSum& sum, double least) const;
    Mat3 gradient_at(const TearContext& context, const splitting::NodeGrid& grid,
                     const splitting::GridEdge& edge, const std::array<std::int32_t, 2>& nodes) const;
    bool is_large(const TearContext& context, std::int32_t piece) const;
    static bool is_whole(const splitting::NodeGrid& grid, const splitting::GridEdge& edge);
    bool shadowed(const splitting::NodeGrid& grid, const splitting::GridEdge& edge, const Vec3& normal) const;
    bool beside_crack(const Vec3& rest, const Vec3& rest_normal, double load) const;
    std::optional<Plane> weak_plane_at(const Vec3& rest) const;
    void break_ligaments(splitting::NodeGrid& grid, const TearContext& context,
                         std::vector<std::int32_t>& slots);
    bool is_first_around(const splitting::NodeGrid& grid, const splitting::GridEdge& edge,
                         const Key& key) const;
    std::uint32_t gaps_in(const splitting::NodeGrid& grid, const TearContext& context, const Key& key) const;
    void close_gaps(splitting::NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots);
    Tip tip_of(const splitting::NodeGrid& grid, CrackCell& cell) const;
    static const geometry::Frame* frame_of(const TearContext& context, const Vec3i& node,
                                           std::int32_t& index);
    double opening_stress(const TearContext& context, CrackCell& cell) const;
    bool list_near_phyxels(const splitting::NodeGrid& grid, const TearContext& context);
    /// As PhyxelLocator::visit, of the phyxels near a cell.
    template <class Use>
    static bool visit_near(const splitting::NodeGrid& grid, const TearContext& context, const Key& cell,
                           const Use& use) {
        const double size = grid.rest().cell_size;
        const Vec3 low = grid.rest().node_position({cell[0], cell[1], cell[2]});
        return context.locator.visit(low + Vec3::Constant(0.5 * size), 1.5 * context.spacing, use);
    }
    std::uint8_t sure_shadows(const splitting::NodeGrid& grid, const Tip& tip,
                              const splitting::GridEdge& edge) const;
    static bool may_meet(const Tip& tip, const Vec3& a, const Vec3& b);
    bool propose(const splitting::NodeGrid& grid, const CrackCell& cell, const Stress& stress,
                 double strength, const splitting::GridEdge& edge, Proposal& out) const;
    Proposal propose(const splitting::NodeGrid& grid, const TearContext& context, const OpenEdge& open) const;
    void ask_edges(const splitting::NodeGrid& grid, const TearContext& context);
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
    void consider(const splitting::NodeGrid& grid, std::uint32_t phyxel, const StartEdge& start,
                  Proposal& best) const;
    bool begin_one(splitting::NodeGrid& grid, const TearContext& context, std::uint32_t phyxel,
                   std::vector<std::int32_t>& slots);
    void begin_cracks(splitting::NodeGrid& grid, const TearContext& context,
                      std::vector<std::int32_t>& slots);
    std::int32_t cut(splitting::NodeGrid& grid, const Proposal& proposal, std::vector<std::int32_t>& slots);

    TearSettings settings_;
    double wave_speed_ = 0;       // m/s, of pressure waves
    double crack_speed_ = 0;      // m/s
    double weakest_all_ = 1;      // of strength_factor over the nodes
    double cell_size_ = 0;        // m
    double opening_modulus_ = 0;  // Pa/m, of the stress ahead of a tip over the gape behind it; 0: not linear
    double break_stretch_ = 2;    // of an edge beside a crack
    double top_load_ = 0;

    std::vector<std::uint8_t> own_rank_;  // per phyxel, of its neighbourhood before any cut
    std::vector<double> weakest_;         // per phyxel, Pa: the least strength of the nodes around it
    std::vector<Mat3> stress_;            // per phyxel, Pa, Cauchy; zero where it has no say
    std::vector<double> size_;            // per phyxel, Pa, Frobenius norm of it; negative: no say
    std::vector<double>
        principal_;  // per phyxel, Pa, no less than its principal stresses; without a say: none
    std::vector<std::uint8_t> is_strained_;  // per phyxel, whether it or one beside it is near the strength
    std::vector<double> chunk_largest_;      // Pa, of size_
    std::vector<double> load_;  // per phyxel, smoothed stress over the weakest strength; 0: below min_load
    std::vector<std::size_t> phyxels_of_;  // per piece
    double reach_ = 0;                     // m, the largest support
    // Per tracked node: of this step where someone wanted it.
    std::vector<NodeStress> node_stress_;
    std::vector<std::uint32_t> wanted_;   // tracked nodes
    std::uint64_t step_ = 0, round_ = 0;  // calls that looked at edges; times that they looked at cells
    // Around one phyxel; of the nodes in a box by their places, -1: none.
    std::vector<StartNode> start_nodes_;
    std::vector<StartEdge> starts_;
    std::vector<std::int32_t> start_numbers_;
    std::vector<std::uint32_t> asked_;  // open edges
    std::vector<Proposal> proposals_;   // to cut now
    std::vector<std::uint32_t> front_;  // crack cells that cracks go on from
    std::vector<Key> touched_;          // cells around edges of this step
    std::vector<Key> parted_;           // nodes that strands parted at
    std::vector<std::uint32_t> gaps_;   // per touched cell, bit an edge
    std::vector<std::uint32_t> order_;  // phyxels past their strength, the most loaded first

    std::size_t known_crossings_ = 0, known_points_ = 0;
    std::vector<CrackCell> crack_cells_;  // in order of first touch
    splitting::SlotMap<1> crack_number_;  // of these, per cell of the grid
    // The phyxels near each, of `phyxels_known_`; of cell k from first_near_[k] on; one more.
    std::vector<std::uint32_t> near_, first_near_;
    std::size_t phyxels_known_ = 0;
    std::vector<std::uint8_t> is_loaded_;  // per crack cell, in this step
    std::vector<OpenEdge> open_;           // of these cells, each once; some have been cut since
    splitting::SlotMap<3> open_number_;    // of these, per edge of the grid
    struct CrackPoint {
        Vec3 rest, normal;
    };
    std::unordered_map<Key, std::vector<CrackPoint>, KeyHash> crack_points_;  // by cubes of side reach_
    double cube_ = 0;                                                         // m, side of these
    std::vector<Vec3> torn_now_;                                              // m, rest: edges of this step
};

}  // namespace splitcubes::body
