// The solver that the options name.
#pragma once

#include <splitcubes/meshless/explicit_solver.h>
#include <splitcubes/meshless/solver.h>

namespace splitcubes::meshless {

/// Steps by one of the solvers; they can take turns, since all state is in Phyxels.
class AnySolver {
  public:
    /// Throws as the solvers do.
    SolverReport step(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                      const StepInput& input, const SolverOptions& options, const Parallel& parallel) {
        if (options.kind == SolverKind::explicit_steps)
            return explicit_.step(phyxels, neighbourhoods, material, input, options, parallel);
        return implicit_.step(phyxels, neighbourhoods, material, input, options, parallel);
    }

    ImplicitSolver& implicit_solver() { return implicit_; }
    ExplicitSolver& explicit_solver() { return explicit_; }

  private:
    ImplicitSolver implicit_;
    ExplicitSolver explicit_;
};

}  // namespace splitcubes::meshless
