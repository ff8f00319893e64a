// Separation of crack faces: cuts the grid edges that still connect them.
#pragma once

#include <splitcubes/fracture/crack_cells.h>
#include <splitcubes/fracture/stress_field.h>

#include <cstdint>
#include <vector>

namespace splitcubes::body {

/// Cuts of edges that a crack leaves uncut although they connect its faces: ligaments, and edges that cracks
/// have passed; see Tearing.
class CrackSeparation {
  public:
    /// The referenced parts must outlive this object.
    CrackSeparation(const StrengthField& strength, const StressField& stress, CrackCells& cells,
                    const meshless::Material& material, const splitting::NodeGrid& grid);

    /// Cuts the open edges that are stretched above the breaking stretch; of those that share a node, only
    /// the most stretched. Appends the slots of the cuts.
    void break_ligaments(splitting::NodeGrid& grid, const TearContext& context,
                         std::vector<std::int32_t>& slots);
    /// Cuts the edges that cracks have passed, whatever their stress, around this step's cuts. The samples on
    /// both sides of a crack no longer see each other, so such an edge would connect the faces without a
    /// force, as a ligament.
    void cut_passed_edges(splitting::NodeGrid& grid, const TearContext& context,
                          std::vector<std::int32_t>& slots);

  private:
    bool is_first_around(const splitting::NodeGrid& grid, const splitting::GridEdge& edge,
                         const CellKey& key) const;
    std::uint32_t passed_edges_in(const splitting::NodeGrid& grid, const TearContext& context,
                                  const CellKey& key) const;

    const StressField& stress_;
    CrackCells& cells_;
    double cell_size_ = 0;      // m
    double break_stretch_ = 2;  // stretch at which an edge beside a crack is cut

    std::vector<CutProposal> proposals_;       // ligaments to cut now
    std::vector<CellKey> separated_nodes_;     // nodes at which a ligament was cut in this step
    std::vector<CellKey> touched_cells_;       // cells around edges cut in this step
    std::vector<std::uint32_t> passed_edges_;  // per touched cell, bit e: edge e is to be cut
    std::uint64_t epoch_ = 0;                  // passes over touched cells
};

}  // namespace splitcubes::body
