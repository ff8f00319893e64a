// One time step of the rigid pieces.
#pragma once

#include <splitcubes/meshless/solver_types.h>

namespace splitcubes::meshless {

/// Moves all rigid pieces of phyxels.rigid by input.dt; their phyxels follow by write_phyxels.
///
/// Free: the centre goes along its parabola exactly, spin is kept and the rotation is
/// that of turn_freely. Momenta lose mass damping as the elastic pieces' do.
///
/// Obstacles: impulses at the contact points, found by projected Gauss-Seidel on the
/// velocities (Erleben 2007), inelastic, with Coulomb friction, against the tangent plane at the
/// nearest place of each obstacle; a point outside may come as near as that in the step. What is left of the
/// velocity when a piece has come to rest, less than a fiftieth of what gravity gives in a substep, is taken.
/// A piece found within one is lifted by a fifth of its depth a step.
///
/// Held: a piece named by input.rigid_holds makes that motion; its momenta are those of it.
void step_rigid(Phyxels& phyxels, const StepInput& input, double mass_damping);

}  // namespace splitcubes::meshless
