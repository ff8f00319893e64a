// Fronts of the cuts of blades within the faces of the grid: how far a blade has come beyond the last edges
// that it cut.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/cutting/sweep.h>
#include <splitcubes/splitting/cut_front.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

class NodeMotion;
struct TrackerContext;

/// The faces of a grid in which cuts of blades end. They follow from the grid. What the end of a blade passes
/// of a face before it cuts one of its edges is not seen.
class BladeFronts {
  public:
    /// Takes in the faces beside newly cut edges, ascending.
    void add(const splitting::NodeGrid& grid, std::span<const std::int32_t> slots);

    /// Moves the fronts of a cut to where its blade is at the end of the last interval. Fronts beside the
    /// edges cut in that interval (slots from first_new on), which must have been added, move to any place,
    /// the others only ahead. Returns those of the others that moved, ascending. blades: of that interval.
    std::vector<splitting::CutFront> advance(splitting::NodeGrid& grid, NodeMotion& motion,
                                             const TrackerContext& context,
                                             std::span<const cutting::SweptBlade> blades,
                                             std::int32_t cut_number, std::size_t first_new);

  private:
    std::vector<splitting::CutFront> near(const splitting::NodeGrid& grid, const NodeMotion& motion,
                                          std::span<const cutting::SweptBlade> blades,
                                          std::int32_t cut_number, std::size_t first_new);

    std::vector<splitting::CutFront> open_;  // ascending
};

/// Moves the fronts beside these slots, all of which are cuts by the blades in a grid at rest, to where the
/// blades came. blades: their whole way, in the grid's rest space.
void place_fronts_at_rest(splitting::NodeGrid& grid, std::span<const std::int32_t> slots,
                          std::span<const cutting::SweptBlade> blades);

}  // namespace splitcubes::body
