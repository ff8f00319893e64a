// The solver that the options name, and the rigid pieces' step.
#pragma once

#include <splitcubes/meshless/energy_guard.h>
#include <splitcubes/meshless/explicit_solver.h>
#include <splitcubes/meshless/implicit_solver.h>
#include <splitcubes/meshless/rigid_step.h>

namespace splitcubes::meshless {

/// Steps by one of the solvers; they can take turns, since all state is in Phyxels. What a
/// step leaves is weighed and mended by EnergyGuard.
class TimeIntegrator {
  public:
    /// Rigid pieces move first; for the elastic solver their phyxels are held.
    /// Throws as the solvers do.
    SolverReport step(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                      const StepInput& input, const SolverOptions& options, const Parallel& parallel) {
        SolverReport report = step_elastic(phyxels, neighbourhoods, material, begin(phyxels, material, input),
                                           options, parallel);
        end(phyxels, report);
        return report;
    }
    /// The two halves of what step does beside the elastic solver's step: rigid pieces move, and what that
    /// is to be given comes back (it refers to this object); then their phyxels follow.
    StepInput begin(Phyxels& phyxels, const Material& material, const StepInput& input) {
        if (phyxels.rigid.empty()) return input;
        check_step_input(phyxels, input);
        step_rigid(phyxels, input, material.mass_damping);
        return hold_rigid(phyxels, input);
    }
    void end(Phyxels& phyxels, SolverReport& report) const {
        if (phyxels.rigid.empty()) return;
        write_phyxels(phyxels);
        for (const RigidPiece& body : phyxels.rigid.bodies) report.contacts += body.touching;
    }
    ImplicitSolver& implicit_solver() { return implicit_; }
    /// Where bodies step together (ImplicitSolver::step_together), between begin and end: the guard
    /// notes what there is, and mends what they come to. Nothing is taken again.
    void watch(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
               const StepInput& input, const SolverOptions& options, const Parallel& parallel);
    void correct(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                 const StepInput& input, const ContactInput& contacts, std::uint32_t part,
                 const SolverOptions& options, SolverReport& report, const Parallel& parallel);

  private:
    SolverReport step_elastic(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                              const Material& material, const StepInput& input, const SolverOptions& options,
                              const Parallel& parallel);
    SolverReport step_once(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                           const StepInput& input, const SolverOptions& options, const Parallel& parallel);
    SolverReport step_finely(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                             const StepInput& input, SolverOptions options, int division,
                             const Parallel& parallel);
    void part_way(const Phyxels& phyxels, const StepInput& input, double left);
    StepInput hold_rigid(const Phyxels& phyxels, const StepInput& input) {
        held_.assign(phyxels.size(), 0);
        held_position_.assign(phyxels.size(), Vec3::Zero());
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            const std::int32_t index = phyxels.rigid.index(phyxels.piece[i]);
            if (index >= 0) {
                held_[i] = 1;
                held_position_[i] = phyxels.rigid.bodies[static_cast<std::size_t>(index)].world_point_of_rest(
                    phyxels.rest_position[i]);
            } else if (!input.held.empty()) {
                held_[i] = input.held[i];
                held_position_[i] = input.held_position[i];
            }
        }
        StepInput out = input;
        out.held = held_;
        out.held_position = held_position_;
        return out;
    }

    ImplicitSolver implicit_;
    ExplicitSolver explicit_;
    EnergyGuard guard_;
    std::span<const double> hold_work_;         // J, per piece, of the last explicit step
    std::vector<Vec3> way_;                     // m, world, where held phyxels are after a part of a step
    std::vector<CachedContact> contact_cache_;  // before the step
    std::vector<std::uint8_t> held_;            // per phyxel, held or rigid
    std::vector<Vec3> held_position_;           // per phyxel, m, world
};

}  // namespace splitcubes::meshless
