// Which parts of a solid are thinner than something, and how thin they are.
#pragma once

#include <splitcubes/splitting/node_grid.h>

namespace splitcubes::body {

struct ThinParts {
    double share = 0;      // of the volume
    double thickness = 0;  // m, of most of them; 0 where there are none
};

/// What no ball of diameter `thickness` (m) that fits into the solid comes near: plates, bars and limbs, but
/// not the edges and corners of what is thick. Measured on the nodes of the grid, of large ones on every
/// second, third ..., so the thickness is right to about a cell.
ThinParts thin_parts(const splitting::NodeGrid& grid, double thickness);

}  // namespace splitcubes::body
