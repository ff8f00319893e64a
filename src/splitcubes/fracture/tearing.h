// Tearing and fracture: cuts the grid edges at which the stress exceeds the strength of the material. The
// paper mentions tearing (sections 1 and 6.3) but no criterion; here it is the largest principal stress
// (Rankine), and a crack grows as a sheet.
#pragma once

#include <splitcubes/fracture/crack_cells.h>
#include <splitcubes/fracture/crack_front.h>
#include <splitcubes/fracture/crack_nucleation.h>
#include <splitcubes/fracture/crack_separation.h>
#include <splitcubes/fracture/strength_field.h>
#include <splitcubes/fracture/stress_field.h>
#include <splitcubes/fracture/tear_context.h>
#include <splitcubes/fracture/tear_settings.h>

#include <cstdint>
#include <vector>

namespace splitcubes::body {

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
///
/// Parts. StrengthField is the strength at rest positions, StressField the stress of phyxels, nodes and
/// edges; CrackCells registers where cracks are; CrackNucleation is the initiation, CrackFront the
/// propagation, CrackSeparation cuts ligaments and passed edges.
class Tearing {
  public:
    /// The settings must have been checked; phyxels and neighbourhoods must be those before any cut.
    Tearing(const TearSettings& settings, const meshless::Material& material, const splitting::NodeGrid& grid,
            const meshless::Phyxels& phyxels, const meshless::Neighbourhoods& neighbourhoods);
    // The parts refer to each other.
    Tearing(const Tearing&) = delete;
    Tearing& operator=(const Tearing&) = delete;

    /// Cuts the edges that tear and returns their slots. Takes O(phyxels) if no stress is near the strength.
    std::vector<std::int32_t> tear(splitting::NodeGrid& grid, const TearContext& context);

    /// Largest ratio of smoothed principal stress to strength over the phyxels, as of the last call of tear;
    /// 0 if it was below four fifths of propagation_ratio.
    double top_load() const { return top_load_; }

  private:
    StrengthField strength_;
    StressField stress_;
    CrackCells cells_;
    CrackFront front_;            // growth
    CrackNucleation nucleation_;  // initiation
    CrackSeparation separation_;  // ligaments and passed edges
    double top_load_ = 0;
};

}  // namespace splitcubes::body
