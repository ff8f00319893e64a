// Time step with the selected elastic solver, rigid pieces and the energy guard.
#pragma once

#include <splitcubes/dynamics/energy_guard.h>
#include <splitcubes/dynamics/explicit_solver.h>
#include <splitcubes/dynamics/implicit/implicit_solver.h>

namespace splitcubes::meshless {

/// Steps with one of the solvers. They can alternate, since all state is in Phyxels: a body that needs too
/// many explicit substeps takes the step implicitly, together with what it touches. EnergyGuard checks and
/// corrects the result of each step.
class TimeIntegrator {
  public:
    /// Takes a step. Rigid pieces move first; their phyxels are held for the elastic solver. Throws like the
    /// solvers.
    SolverReport step(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                      const StepInput& input, const SolverOptions& options, const Parallel& parallel) {
        SolverReport report = step_elastic(phyxels, neighbourhoods, material, begin(phyxels, material, input),
                                           options, parallel);
        end(phyxels, report);
        return report;
    }
    /// begin and end are what step does around the elastic solver. begin moves the rigid pieces and returns
    /// the input of the elastic solver (it refers to this object); end updates the phyxels of the rigid
    /// pieces.
    StepInput begin(Phyxels& phyxels, const Material& material, const StepInput& input);
    void end(Phyxels& phyxels, SolverReport& report) const {
        if (phyxels.rigid.empty()) return;
        report.work.holds += rigid_hold_work_;
        write_phyxels(phyxels);
        for (const RigidPiece& body : phyxels.rigid.bodies) report.contacts += body.touching;
    }
    /// One of several bodies that are in contact with each other.
    struct Member {
        TimeIntegrator& solver;
        Phyxels& phyxels;
        const Neighbourhoods& neighbourhoods;
        const Material& material;
        const StepInput& input;    // `contacts` is ignored
        SolverReport report = {};  // output
    };
    /// Steps bodies together, between begin and end of each. Part k of the contacts is member k. Corrects
    /// energy excesses; the step is not repeated.
    static void step_together(std::span<Member> members, const ContactInput& contacts,
                              const SolverOptions& options, const Parallel& parallel);

  private:
    SolverReport step_elastic(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                              const Material& material, const StepInput& input, SolverOptions options,
                              const Parallel& parallel);
    SolverReport step_once(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                           const StepInput& input, const SolverOptions& options, const Parallel& parallel);
    SolverReport step_with_substeps(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                    const Material& material, const StepInput& input, SolverOptions options,
                                    int division, const Parallel& parallel);
    static SolverOptions implicit_instead(SolverOptions options);
    static bool solve_together(std::span<Member> members, const ContactInput& contacts,
                               const SolverOptions& options, const Parallel& parallel);
    double largest_rotation(const Phyxels& phyxels, const StepInput& input, const Parallel& parallel);
    int rotation_substeps(const Phyxels& phyxels, const StepInput& input, const Parallel& parallel);
    SolverReport step_in_two_stages(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                    const Material& material, const StepInput& input, SolverOptions options,
                                    const Parallel& parallel);
    void interpolate_held_positions(const Phyxels& phyxels, const StepInput& input, double remaining);
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

    /// Motion before the step, per phyxel.
    struct Start {
        std::vector<Vec3> position, velocity;   // m, m/s
        std::vector<Momenta> momenta, partial;  // per piece; scratch
        std::vector<double> rates;              // rad/s, per piece; scratch
    };

    ImplicitSolver implicit_;
    ExplicitSolver explicit_;
    EnergyGuard guard_;
    // Buffers of the first member of a step of several bodies.
    std::vector<ImplicitSolver::Member> implicit_members_;
    std::vector<ExplicitSolver::Member> explicit_members_;
    std::span<const double> hold_work_, contact_work_;  // J, per piece, of the last explicit step
    Start stage_start_;                                 // of a step in two stages
    std::vector<Vec3> substep_position_;                // m, world, of held phyxels after a substep
    std::vector<CachedContact> contact_cache_;          // before the step
    std::vector<std::uint8_t> held_;                    // per phyxel, held or rigid
    std::vector<Vec3> held_position_;                   // per phyxel, m, world
    double rigid_hold_work_ = 0;                        // J, on held rigid pieces in the step
};

}  // namespace splitcubes::meshless
