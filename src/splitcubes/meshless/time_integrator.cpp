#include <splitcubes/meshless/time_integrator.h>

#include <algorithm>
#include <array>

namespace splitcubes::meshless {

namespace {

// Shares of the elastic energy that may come and go in a step: a mode near the limit of
// stability lends as much of its own to the leapfrog (EnergyGuard).
constexpr double implicit_tolerance = 0.02, explicit_tolerance = 0.25;
// What a step that cannot be paid for is divided into, one after the other.
constexpr std::array<int, 3> implicit_divisions = {1, 2, 4}, explicit_divisions = {2, 4, 8};
// Newton steps of a step that is taken again, beside the first.
constexpr int further_solves = 2;

}  // namespace

SolverReport TimeIntegrator::step_elastic(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                          const Material& material, const StepInput& input,
                                          const SolverOptions& options, const Parallel& parallel) {
    check_step_input(phyxels, input);
    if (!options.guard_energy) return step_once(phyxels, neighbourhoods, material, input, options, parallel);
    const bool leaps = options.kind == SolverKind::explicit_steps;
    const std::array<int, 3>& divisions = leaps ? explicit_divisions : implicit_divisions;
    const double tolerance = leaps ? explicit_tolerance : implicit_tolerance;
    // Contacts are those of the whole step: it is not divided.
    const std::size_t most = leaps || input.contacts.empty() ? divisions.size() : 1;
    if (input.contacts.cached) {
        contact_cache_.reserve(input.contacts.contacts.size());
        contact_cache_ = *input.contacts.cached;
    }
    guard_.begin(phyxels, neighbourhoods, material, input, parallel);
    SolverReport report = step_once(phyxels, neighbourhoods, material, input, options, parallel);
    for (std::size_t k = 0;; ++k) {
        guard_.count_contacts(phyxels, input.contacts, 0, !leaps);
        const bool strained =
            guard_.weigh(phyxels, neighbourhoods, material, input, tolerance, hold_work_, parallel);
        if (!strained || k == most) break;
        guard_.go_back(phyxels);
        if (input.contacts.cached) *input.contacts.cached = contact_cache_;
        const std::size_t non_finite = report.non_finite;
        report = step_finely(phyxels, neighbourhoods, material, input, options, divisions[k], parallel);
        report.non_finite = std::max(report.non_finite, non_finite);
        report.retries = static_cast<int>(k) + 1;
    }
    guard_.settle(phyxels, neighbourhoods, material, input, report, parallel);
    return report;
}

void TimeIntegrator::watch(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                           const Material& material, const StepInput& input, const SolverOptions& options,
                           const Parallel& parallel) {
    if (options.guard_energy) guard_.begin(phyxels, neighbourhoods, material, input, parallel);
}

void TimeIntegrator::correct(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                             const StepInput& input, const ContactInput& contacts, std::uint32_t part,
                             const SolverOptions& options, SolverReport& report, const Parallel& parallel) {
    if (!options.guard_energy) return;
    guard_.count_contacts(phyxels, contacts, part, options.kind != SolverKind::explicit_steps);
    guard_.weigh(phyxels, neighbourhoods, material, input, implicit_tolerance, {}, parallel);
    guard_.settle(phyxels, neighbourhoods, material, input, report, parallel);
}

SolverReport TimeIntegrator::step_once(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                       const Material& material, const StepInput& input,
                                       const SolverOptions& options, const Parallel& parallel) {
    if (options.kind != SolverKind::explicit_steps) {
        hold_work_ = {};
        return implicit_.step(phyxels, neighbourhoods, material, input, options, parallel);
    }
    const SolverReport report = explicit_.step(phyxels, neighbourhoods, material, input, options, parallel);
    hold_work_ = explicit_.hold_work();
    return report;
}

// The explicit solver with more substeps, the implicit one by backward Euler in equal parts.
SolverReport TimeIntegrator::step_finely(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                         const Material& material, const StepInput& input,
                                         SolverOptions options, int division, const Parallel& parallel) {
    if (options.kind == SolverKind::explicit_steps) {
        options.refinement *= division;
        phyxels.substeps = 0;
        const SolverReport report = step_once(phyxels, neighbourhoods, material, input, options, parallel);
        phyxels.substeps = 0;
        return report;
    }
    options.bdf2 = false;
    options.further_solves = further_solves;
    StepInput part = input;
    part.dt = input.dt / division;
    SolverReport report;
    int iterations = 0, solves = 0;
    std::size_t non_finite = 0;
    for (int k = 1; k <= division; ++k) {
        if (!input.held.empty()) {
            part_way(phyxels, input, static_cast<double>(division - k) / (division - k + 1));
            part.held_position = way_;
        }
        report = step_once(phyxels, neighbourhoods, material, part, options, parallel);
        iterations += report.iterations;
        solves += report.solves;
        non_finite = std::max(non_finite, report.non_finite);
    }
    report.iterations = iterations;
    report.solves = solves;
    report.non_finite = non_finite;
    guard_.forget_parts(phyxels, input.dt);
    return report;
}

// Where held phyxels are when `left` of what is left of their way is left, into way_.
void TimeIntegrator::part_way(const Phyxels& phyxels, const StepInput& input, double left) {
    way_.resize(phyxels.size());
    for (std::size_t i = 0; i < way_.size(); ++i) {
        way_[i] = input.held_position[i];
        if (input.held[i] != 0) way_[i] += left * (phyxels.position[i] - input.held_position[i]);
    }
}

}  // namespace splitcubes::meshless
