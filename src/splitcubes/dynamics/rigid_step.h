// Time step of the rigid pieces.
#pragma once

#include <splitcubes/dynamics/solver_types.h>

namespace splitcubes::meshless {

/// Moves all rigid pieces of phyxels.rigid by input.dt; write_phyxels updates their phyxels afterwards.
///
/// Free pieces: the centre follows its parabola exactly, angular momentum is conserved, and turn_freely
/// integrates the rotation. Mass damping reduces the momenta as for elastic pieces.
///
/// Obstacles: impulses at the contact points, by projected Gauss-Seidel on the velocities (Erleben 2007),
/// inelastic, with Coulomb friction, against the tangent plane at the nearest point of each obstacle. A point
/// outside may approach by at most its distance in the step. A touching piece whose remaining velocity is
/// less than a fiftieth of what gravity adds in a substep is stopped. Initial penetration is reduced by a
/// fifth per step.
///
/// Held pieces: a piece named by input.kinematic_rigid_pieces follows that motion; its momenta are those of
/// the motion.
void step_rigid(Phyxels& phyxels, const StepInput& input, double mass_damping);

}  // namespace splitcubes::meshless
