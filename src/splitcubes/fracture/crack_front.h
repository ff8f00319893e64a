// Crack fronts: where existing cracks grow.
#pragma once

#include <splitcubes/fracture/crack_cells.h>
#include <splitcubes/fracture/stress_field.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace splitcubes::body {

/// Growth of the cracks of one body, cell by cell across the edges around their fronts; see Tearing.
class CrackFront {
  public:
    /// The referenced parts must outlive this object.
    CrackFront(const StrengthField& strength, StressField& stress, CrackCells& cells,
               const meshless::Material& material, const splitting::NodeGrid& grid);

    /// Grows all cracks near which a phyxel is loaded enough, as far as the crack speed allows in a step, and
    /// appends the slots of the cuts.
    void grow_loaded(splitting::NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots);
    /// Grows the cracks in the crack cells from index `first` on in the same way.
    void grow_from(std::size_t first, splitting::NodeGrid& grid, const TearContext& context,
                   std::vector<std::int32_t>& slots);

  private:
    void grow(splitting::NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots);
    CrackTip tip_of(const splitting::NodeGrid& grid, CrackCell& cell) const;
    double opening_stress(const TearContext& context, CrackCell& cell) const;
    bool list_near_phyxels(const splitting::NodeGrid& grid, const TearContext& context);
    /// Calls use for the phyxels near a cell; see PhyxelLocator::visit.
    template <class Use>
    static bool visit_near(const splitting::NodeGrid& grid, const TearContext& context, const CellKey& cell,
                           const Use& use) {
        const double size = grid.rest().cell_size;
        const Vec3 low = grid.rest().node_position({cell[0], cell[1], cell[2]});
        return context.locator.visit(low + Vec3::Constant(0.5 * size), 1.5 * context.spacing, use);
    }
    static std::uint8_t certain_shielding(const splitting::NodeGrid& grid, const CrackTip& tip,
                                          const splitting::GridEdge& edge);
    static bool may_meet(const CrackTip& tip, const Vec3& a, const Vec3& b);
    bool propose(const splitting::NodeGrid& grid, const CrackCell& cell, const EdgeStress& stress,
                 double strength, const splitting::GridEdge& edge, CutProposal& out) const;
    CutProposal propose(const splitting::NodeGrid& grid, const TearContext& context,
                        const OpenEdge& open) const;
    void list_front_edges(const splitting::NodeGrid& grid, const TearContext& context);
    void find_proposals(const splitting::NodeGrid& grid, const TearContext& context);
    void find_loaded_front(const splitting::NodeGrid& grid, const TearContext& context);

    const StrengthField& strength_;
    StressField& stress_;
    CrackCells& cells_;
    double crack_speed_ = 0;      // m/s
    double cell_size_ = 0;        // m
    double opening_modulus_ = 0;  // Pa/m, stress ahead of a tip over crack opening behind it; 0: not elastic

    std::vector<std::uint32_t> front_;        // crack cells from which cracks may grow
    std::vector<std::uint8_t> is_loaded_;     // per crack cell, in this step
    std::vector<std::uint32_t> front_edges_;  // open edges of the front
    std::uint64_t epoch_ = 0;                 // calls of list_front_edges
    std::vector<CutProposal> proposals_;      // edges to cut now
    std::vector<CellKey> touched_cells_;      // cells around the edges cut last
    // Phyxels near crack cell k: near_[first_near_[k]] up to near_[first_near_[k + 1]], valid while there are
    // phyxels_known_ phyxels.
    std::vector<std::uint32_t> near_, first_near_;
    std::size_t phyxels_known_ = 0;
};

}  // namespace splitcubes::body
