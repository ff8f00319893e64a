// Masses of phyxels that keep the centres of mass of pieces.
#pragma once

#include <splitcubes/samples/mass_lumping.h>
#include <splitcubes/samples/phyxels.h>

#include <vector>

namespace splitcubes::meshless {

/// Changes the masses of the phyxels so that each piece has the first moment of its nodes in rest space,
/// which no cut changes: mass that moved when a piece was lumped anew would gain or lose potential energy.
/// The change is the smallest relative to the masses, and linear in the rest position. Pieces without an
/// extent in some direction keep their moment along it. No mass changes by more than
/// lumping::max_mass_change of itself; thin pieces are given up first along their thickness. The mass of a
/// piece stays. density: kg/m^3.
void keep_centres_of_mass(const MaterialNodes& nodes, double density, Phyxels& phyxels);

}  // namespace splitcubes::meshless
