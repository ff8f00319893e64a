// Finds parts of a solid that are thinner than a given thickness.
#pragma once

#include <splitcubes/splitting/node_grid.h>

namespace splitcubes::body {

struct ThinParts {
    double share = 0;      // of the volume
    double thickness = 0;  // m, of most of these parts; 0: there are none
};

/// Measures the parts that no ball of diameter `thickness` (m) inside the solid comes near: plates, bars and
/// limbs, but not edges and corners of thick parts. Uses the nodes of the grid, of a large grid only every
/// second, third etc., so the thickness is accurate to about a cell.
ThinParts thin_parts(const splitting::NodeGrid& grid, double thickness);

}  // namespace splitcubes::body
