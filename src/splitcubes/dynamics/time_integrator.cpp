#include <splitcubes/dynamics/rigid_step.h>
#include <splitcubes/dynamics/time_integrator.h>
#include <splitcubes/dynamics/tuning.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace splitcubes::meshless {

StepInput TimeIntegrator::begin(Phyxels& phyxels, const Material& material, const StepInput& input) {
    if (phyxels.rigid.empty()) return input;
    check_step_input(phyxels, input);
    const auto energy_of_held = [&] {
        double sum = 0;
        for (const RigidKinematicTarget& target : input.kinematic_rigid_pieces) {
            const RigidPiece& piece = phyxels.rigid.bodies[target.body];
            sum += piece.kinetic_energy() - piece.mass * input.gravity.dot(piece.centre);
        }
        return sum;
    };
    const double before = energy_of_held();
    step_rigid(phyxels, input, material.mass_damping);
    rigid_hold_work_ = energy_of_held() - before;
    return hold_rigid(phyxels, input);
}

SolverReport TimeIntegrator::step_elastic(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                          const Material& material, const StepInput& input,
                                          SolverOptions options, const Parallel& parallel) {
    check_step_input(phyxels, input);
    if (!options.guard_energy) return step_once(phyxels, neighbourhoods, material, input, options, parallel);
    if (input.contacts.cached) {
        contact_cache_.reserve(input.contacts.contacts.size());
        contact_cache_ = *input.contacts.cached;
    }
    guard_.begin(phyxels, neighbourhoods, material, input, parallel);
    const bool is_undivided = options.kind == SolverKind::explicit_steps || !input.contacts.empty();
    const int parts = is_undivided ? 1 : rotation_substeps(phyxels, input, parallel);
    SolverReport report =
        parts > 1 ? step_with_substeps(phyxels, neighbourhoods, material, input, options, parts, parallel)
                  : step_once(phyxels, neighbourhoods, material, input, options, parallel);
    bool took_implicit = false;
    for (std::size_t k = 0;; ++k) {
        // A step that needs too many substeps would need even more when it is repeated.
        took_implicit = took_implicit || report.took_implicit;
        if (took_implicit) options = implicit_instead(options);
        const bool is_explicit = options.kind == SolverKind::explicit_steps;
        const std::array<int, 3>& divisions =
            is_explicit ? tuning::energy::explicit_divisions : tuning::energy::implicit_divisions;
        const tuning::energy::Tolerance& tolerance =
            is_explicit ? tuning::energy::explicit_tolerance : tuning::energy::implicit_tolerance;
        // Contacts belong to the whole step, which is therefore not divided.
        const std::size_t max_repetitions = is_explicit || input.contacts.empty() ? divisions.size() : 0;
        guard_.count_contacts(phyxels, input, input.contacts, 0, contact_work_);
        const bool strained =
            guard_.evaluate(phyxels, neighbourhoods, material, input, tolerance, hold_work_, parallel);
        if (!strained || k >= max_repetitions) break;
        guard_.restore_start(phyxels);
        if (input.contacts.cached) *input.contacts.cached = contact_cache_;
        const std::size_t non_finite = report.non_finite;
        report =
            step_with_substeps(phyxels, neighbourhoods, material, input, options, divisions[k], parallel);
        report.non_finite = std::max(report.non_finite, non_finite);
        report.retries = static_cast<int>(k) + 1;
    }
    report.took_implicit = took_implicit;
    guard_.enforce(phyxels, neighbourhoods, material, input, report, parallel);
    return report;
}

SolverReport TimeIntegrator::step_once(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                       const Material& material, const StepInput& input,
                                       const SolverOptions& options, const Parallel& parallel) {
    if (options.kind != SolverKind::explicit_steps) {
        hold_work_ = contact_work_ = {};
        // Contacts belong to the whole step, which is therefore not divided.
        if (options.scheme == TimeScheme::tr_bdf2 && input.contacts.empty() &&
            largest_rotation(phyxels, input, parallel) <= tuning::stages::max_rotation)
            return step_in_two_stages(phyxels, neighbourhoods, material, input, options, parallel);
        return implicit_.step(phyxels, neighbourhoods, material, input, options, parallel);
    }
    SolverReport report;
    if (explicit_.step(phyxels, neighbourhoods, material, input, options, report, parallel)) {
        hold_work_ = explicit_.hold_work();
        contact_work_ = explicit_.contact_work();
        return report;
    }
    report = step_once(phyxels, neighbourhoods, material, input, implicit_instead(options), parallel);
    phyxels.substeps = tuning::explicit_steps::max_substeps_per_step + 1;
    report.took_implicit = true;
    return report;
}

// Returns the options of a step that would need too many explicit substeps.
SolverOptions TimeIntegrator::implicit_instead(SolverOptions options) {
    options.kind = SolverKind::implicit_steps;
    options.refinement = 1;
    return options;
}

void TimeIntegrator::step_together(std::span<Member> members, const ContactInput& contacts,
                                   const SolverOptions& options, const Parallel& parallel) {
    for (Member& m : members)
        if (options.guard_energy)
            m.solver.guard_.begin(m.phyxels, m.neighbourhoods, m.material, m.input, parallel);
    const bool is_explicit = solve_together(members, contacts, options, parallel);
    if (!options.guard_energy) return;
    const tuning::energy::Tolerance& tolerance =
        is_explicit ? tuning::energy::explicit_tolerance : tuning::energy::implicit_tolerance;
    for (std::uint32_t k = 0; k < members.size(); ++k) {
        Member& m = members[k];
        EnergyGuard& guard = m.solver.guard_;
        guard.count_contacts(m.phyxels, m.input, contacts, k,
                             is_explicit ? m.solver.explicit_.contact_work() : std::span<const double>());
        guard.evaluate(m.phyxels, m.neighbourhoods, m.material, m.input, tolerance,
                       is_explicit ? m.solver.explicit_.hold_work() : std::span<const double>(), parallel);
        guard.enforce(m.phyxels, m.neighbourhoods, m.material, m.input, m.report, parallel);
    }
}

// Returns whether the step was explicit.
bool TimeIntegrator::solve_together(std::span<Member> members, const ContactInput& contacts,
                                    const SolverOptions& options, const Parallel& parallel) {
    if (options.kind == SolverKind::explicit_steps) {
        std::vector<ExplicitSolver::Member>& parts = members[0].solver.explicit_members_;
        parts.clear();
        for (Member& m : members)
            parts.push_back({m.solver.explicit_, m.phyxels, m.neighbourhoods, m.material, m.input});
        if (ExplicitSolver::step_together(parts, contacts, options, parallel)) {
            for (std::size_t k = 0; k < members.size(); ++k) members[k].report = parts[k].report;
            return true;
        }
    }
    std::vector<ImplicitSolver::Member>& parts = members[0].solver.implicit_members_;
    parts.clear();
    for (Member& m : members)
        parts.push_back({m.solver.implicit_, m.phyxels, m.neighbourhoods, m.material, m.input});
    ImplicitSolver::step_together(parts, contacts, implicit_instead(options), parallel);
    for (std::size_t k = 0; k < members.size(); ++k) {
        members[k].report = parts[k].report;
        members[k].report.took_implicit = options.kind == SolverKind::explicit_steps;
        // The next step does not try until it needs fewer.
        if (members[k].report.took_implicit)
            members[k].phyxels.substeps = tuning::explicit_steps::max_substeps_per_step + 1;
    }
    return false;
}

// Repeats the step: explicit with more substeps, implicit by backward Euler in equal substeps.
SolverReport TimeIntegrator::step_with_substeps(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                                const Material& material, const StepInput& input,
                                                SolverOptions options, int division,
                                                const Parallel& parallel) {
    if (options.kind == SolverKind::explicit_steps) {
        options.refinement *= division;
        phyxels.substeps = 0;
        const SolverReport report = step_once(phyxels, neighbourhoods, material, input, options, parallel);
        phyxels.substeps = 0;
        return report;
    }
    options.scheme = TimeScheme::backward_euler;
    options.further_solves = tuning::energy::further_newton_solves;
    StepInput substep = input;
    substep.dt = input.dt / division;
    SolverReport report;
    int iterations = 0, solves = 0;
    std::size_t non_finite = 0;
    for (int k = 1; k <= division; ++k) {
        if (!input.held.empty()) {
            interpolate_held_positions(phyxels, input,
                                       static_cast<double>(division - k) / (division - k + 1));
            substep.held_position = substep_position_;
        }
        report = step_once(phyxels, neighbourhoods, material, substep, options, parallel);
        iterations += report.iterations;
        solves += report.solves;
        non_finite = std::max(non_finite, report.non_finite);
    }
    report.iterations = iterations;
    report.solves = solves;
    report.non_finite = non_finite;
    guard_.reset_history(phyxels, input.dt);
    return report;
}

// Returns the largest rotation of an elastic piece in the step, rad.
double TimeIntegrator::largest_rotation(const Phyxels& phyxels, const StepInput& input,
                                        const Parallel& parallel) {
    momenta_of_pieces(phyxels, input.piece_count, stage_start_.momenta, stage_start_.partial, parallel);
    return find_rotation_rates(phyxels, stage_start_.momenta, stage_start_.rates) * input.dt;
}

// Returns the number of parts of the step in which no piece rotates too far. The velocities that multistep
// schemes find from positions on an arc have a share along the radius, and the orientation of a tumbling
// piece drifts.
int TimeIntegrator::rotation_substeps(const Phyxels& phyxels, const StepInput& input,
                                      const Parallel& parallel) {
    const double angle = largest_rotation(phyxels, input, parallel);
    if (!(angle > tuning::stages::max_rotation)) return 1;
    return static_cast<int>(std::min<double>(std::ceil(angle / tuning::stages::substep_rotation),
                                             tuning::stages::max_rotation_substeps));
}

// TR-BDF2 (Bank et al. 1985): the trapezoidal rule over gamma = 2 - sqrt(2) of the step, then BDF2 over both
// parts. With this gamma both stages have the same effective step, dt (1 - sqrt(2) / 2), and the whole is
// L-stable (Hosea and Shampine 1996).
SolverReport TimeIntegrator::step_in_two_stages(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                                const Material& material, const StepInput& input,
                                                SolverOptions options, const Parallel& parallel) {
    const double gamma = 2 - std::sqrt(2.0);
    stage_start_.position = phyxels.position;
    stage_start_.velocity = phyxels.velocity;
    StepInput stage = input;
    stage.dt = gamma * input.dt;
    if (!input.held.empty()) {
        interpolate_held_positions(phyxels, input, 1 - gamma);
        stage.held_position = substep_position_;
    }
    options.stage = TimeStage::trapezoidal;
    const SolverReport first = implicit_.step(phyxels, neighbourhoods, material, stage, options, parallel);
    stage.dt = (1 - gamma) * input.dt;
    stage.held_position = input.held_position;
    options.stage = TimeStage::second;
    SolverReport report = implicit_.step(phyxels, neighbourhoods, material, stage, options, parallel);
    report.iterations += first.iterations;
    report.solves += first.solves;
    report.residual = std::max(report.residual, first.residual);
    report.non_finite = std::max(report.non_finite, first.non_finite);
    phyxels.previous_position.swap(stage_start_.position);
    phyxels.previous_velocity.swap(stage_start_.velocity);
    phyxels.history_step = input.dt;
    return report;
}

// Writes the positions of held phyxels after which the share `remaining` of their remaining displacement is
// left.
void TimeIntegrator::interpolate_held_positions(const Phyxels& phyxels, const StepInput& input,
                                                double remaining) {
    substep_position_.resize(phyxels.size());
    for (std::size_t i = 0; i < substep_position_.size(); ++i) {
        substep_position_[i] = input.held_position[i];
        if (input.held[i] != 0)
            substep_position_[i] += remaining * (phyxels.position[i] - input.held_position[i]);
    }
}

}  // namespace splitcubes::meshless
