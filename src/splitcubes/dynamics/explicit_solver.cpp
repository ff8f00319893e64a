#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/dynamics/explicit_solver.h>
#include <splitcubes/dynamics/tuning.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace splitcubes::meshless {

SolverReport ExplicitSolver::step(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                  const Material& material, const StepInput& input,
                                  const SolverOptions& options, const Parallel& parallel) {
    check_step_input(phyxels, input);
    const Job job{phyxels, neighbourhoods, material, input, parallel, std::max(options.refinement, 1)};
    SolverReport report;
    begin(job);
    const std::array<ContactImpulses::Part, 1> parts = {{{start_position_, effective_mass_, held_}}};
    contacts_.begin(input.contacts, parts, input.dt);
    report.substeps = take_substeps(job);
    const std::array<std::span<std::uint8_t>, 1> touching = {phyxels.touching};
    std::fill(phyxels.touching.begin(), phyxels.touching.end(), std::uint8_t{0});
    contacts_.finish(touching);
    if (options.restore_momentum) restore_momenta(job);
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        phyxels.previous_position[i] = start_position_[i];
        phyxels.previous_velocity[i] = start_velocity_[i];
        phyxels.restart_history[i] = held_[i] != 0 || failed_[i] != 0;
        report.non_finite += failed_[i];
    }
    if (input.contacts.cached) report.contacts = input.contacts.cached->size();
    phyxels.history_step = input.dt;
    describe_(phyxels, neighbourhoods, elastic_, report, parallel);
    return report;
}

void ExplicitSolver::begin(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    const std::size_t n = phyxels.size();
    momenta_.begin(phyxels, job.input.piece_count, job.parallel);
    double total = 0;
    for (const double m : phyxels.mass) total += m;
    const double min_mass =
        total > 0 ? tuning::explicit_steps::min_mass_share * total / static_cast<double>(n) : 1;
    effective_mass_.resize(n);
    inverse_mass_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
        effective_mass_[i] = std::max(phyxels.mass[i], min_mass);
        inverse_mass_[i] = 1 / effective_mass_[i];
    }
    zeros_.assign(n, 0);
    for (auto* array : {&force_, &damping_, &mode_, &product_}) array->assign(n, Vec3::Zero());
    start_position_ = phyxels.position;
    start_velocity_ = phyxels.velocity;
    failed_.assign(n, 0);
    if (job.input.held.empty())
        held_.assign(n, 0);
    else
        held_.assign(job.input.held.begin(), job.input.held.end());
    gravity_time_ = 0;
    hold_work_.clear();
    for (std::size_t i = 0; i < n && hold_work_.empty(); ++i)
        if (held_[i] != 0 && job.input.held_position[i] != start_position_[i])
            hold_work_.assign(static_cast<std::size_t>(std::max(job.input.piece_count, 0)), 0);
}

// Adds half of the work of the holds in a substep h, s, with the current forces.
void ExplicitSolver::add_hold_work(const Job& job, double h) {
    if (hold_work_.empty()) return;
    for (std::size_t i = 0; i < job.phyxels.size(); ++i) {
        const std::int32_t piece = job.phyxels.piece[i];
        if (held_[i] == 0 || piece < 0 || static_cast<std::size_t>(piece) >= hold_work_.size()) continue;
        const Vec3 displacement = h / job.input.dt * (job.input.held_position[i] - start_position_[i]);
        hold_work_[static_cast<std::size_t>(piece)] -= 0.5 * displacement.dot(force_[i] - damping_[i]);
    }
}

// Draws a mode that contains every eigenmode; deterministic.
void ExplicitSolver::draw_initial_mode(const Job& job) {
    Random random(1);
    for (std::size_t i = 0; i < job.phyxels.size(); ++i)
        for (int axis = 0; axis < 3; ++axis) mode_[i][axis] = random.uniform(-1, 1);
}

// Returns an estimate of w, rad/s, from below. Continues from mode_, which converges to the eigenmode.
double ExplicitSolver::highest_frequency(const Job& job, int iterations) {
    const std::size_t n = job.phyxels.size();
    double frequency = 0;
    for (int iteration = 0; iteration < iterations; ++iteration) {
        elastic_.apply_stiffness(1, zeros_, mode_, product_, job.parallel);
        const auto norm = [&](const std::vector<Vec3>& of) {
            return std::sqrt(sum_(job.parallel, n, [&](std::size_t begin, std::size_t end) {
                double sum = 0;
                for (std::size_t i = begin; i < end; ++i) sum += effective_mass_[i] * of[i].squaredNorm();
                return sum;
            }));
        };
        const double before = norm(mode_);
        for_phyxels(job.parallel, n, [&](std::size_t i) { product_[i] /= effective_mass_[i]; });
        const double after = norm(product_);
        if (!(after > 0) || !(before > 0) || !std::isfinite(after)) return frequency;
        frequency = std::sqrt(after / before);
        for_phyxels(job.parallel, n, [&](std::size_t i) { mode_[i] = product_[i] / after; });
    }
    return frequency;
}

// Returns w with the tangents at rest, rad/s.
double ExplicitSolver::frequency_at_rest(const Job& job) {
    const double mu = job.material.lame_mu(), lambda = job.material.lame_lambda();
    if (frequency_cache_.revision == job.neighbourhoods.revision() && frequency_cache_.mu == mu &&
        frequency_cache_.lambda == lambda && frequency_cache_.effective_mass == effective_mass_)
        return frequency_cache_.frequency;
    elastic_.take_state(job.neighbourhoods, job.material,
                        {job.phyxels.rest_position, job.phyxels.rest_position, job.phyxels.rotation, {}},
                        job.parallel);
    draw_initial_mode(job);
    frequency_cache_ = {job.neighbourhoods.revision(), mu, lambda, effective_mass_,
                        highest_frequency(job, tuning::explicit_steps::first_power_iterations)};
    return frequency_cache_.frequency;
}

double ExplicitSolver::max_stable_step(const Job& job, int iterations) {
    double frequency = 0;
    if (is_frame_sufficient(job.material)) {
        frequency = frequency_at_rest(job);
    } else {
        elastic_.take_state(job.neighbourhoods, job.material, configuration_of(job.phyxels), job.parallel);
        frequency = highest_frequency(job, iterations);
    }
    if (!(frequency > 0)) return std::numeric_limits<double>::infinity();
    const double z = 0.5 * job.material.stiffness_damping * frequency;
    return 2 / frequency / (std::sqrt(1 + z * z) + z);
}

// Returns the number of substeps of a whole step; `before` if that is still in range.
int ExplicitSolver::substeps_for(const Job& job, int before, int iterations) {
    const double substeps_at_limit =
        job.refinement * job.input.dt / max_stable_step(job, iterations);  // at the stability limit
    const tuning::explicit_steps::Margin& margin = is_frame_sufficient(job.material)
                                                       ? tuning::explicit_steps::steady_margin
                                                       : tuning::explicit_steps::growing_margin;
    if (before > 0 && before >= substeps_at_limit / margin.max && before <= substeps_at_limit / margin.min)
        return before;
    const double needed_substeps = std::ceil(substeps_at_limit / margin.chosen);
    if (!(needed_substeps <= tuning::explicit_steps::max_substeps_per_step))
        throw JobError("the explicit solver needs over " +
                       std::to_string(tuning::explicit_steps::max_substeps_per_step) +
                       " substeps a time step; take the implicit one, or a softer material");
    return std::max(1, static_cast<int>(needed_substeps));
}

// Takes the whole step; returns the number of substeps.
int ExplicitSolver::take_substeps(const Job& job) {
    const double dt = job.input.dt;
    const bool changes =
        job.material.model == MaterialModel::st_venant_kirchhoff || job.material.volume_stiffness > 0;
    const bool known = job.phyxels.history_step == dt;
    if (!is_frame_sufficient(job.material)) draw_initial_mode(job);
    int per_step =
        substeps_for(job, known ? job.phyxels.substeps : 0, tuning::explicit_steps::first_power_iterations);
    elastic_.take_state(job.neighbourhoods, job.material, configuration_of(job.phyxels), job.parallel);
    elastic_.read_deformation(job.phyxels.deformation, job.phyxels.rotation, job.parallel);
    find_forces(job);
    double done = 0;  // share of the step
    int substeps_taken = 0;
    while (done < 1) {
        const int count = std::max(1, static_cast<int>(std::ceil((1 - done) * per_step - 1e-6)));
        const double share = (1 - done) / count;
        const double bound =
            changes ? tuning::explicit_steps::growth_between_estimates * largest_stretch(job) : 0;
        int k = 0;
        do {
            ++k;
            substep(job, share * dt, k == count ? 1 : done + k * share);
        } while (k < count && (!changes || (k < tuning::explicit_steps::substeps_between_estimates &&
                                            largest_stretch(job) < bound)));
        substeps_taken += k;
        done = k == count ? 1 : done + k * share;
        // Within a step substeps only become shorter.
        if (done < 1)
            per_step = std::max(
                per_step, substeps_for(job, per_step, tuning::explicit_steps::further_power_iterations));
    }
    elastic_.read_deformation(job.phyxels.deformation, job.phyxels.rotation, job.parallel);
    job.phyxels.substeps = per_step;
    return substeps_taken;
}

// Returns the largest |F|^2 of any phyxel; the stiffness of St. Venant-Kirchhoff grows with it.
double ExplicitSolver::largest_stretch(const Job& job) const {
    double largest = 0;
    for (const Mat3& F : job.phyxels.deformation) largest = std::max(largest, F.squaredNorm());
    return largest;
}

void ExplicitSolver::substep(const Job& job, double h, double done) {
    add_hold_work(job, h);
    kick(job, 0.5 * h);
    drift(job, h, done);
    deform(job, h);
    find_forces(job);
    add_hold_work(job, h);
    kick(job, 0.5 * h);
    const std::array<std::span<Vec3>, 1> velocity = {job.phyxels.velocity};
    contacts_.stop(velocity);
}

void ExplicitSolver::deform(const Job& job, double h) {
    if (!is_frame_sufficient(job.material))
        deform_and_flow(job.phyxels, job.neighbourhoods, job.material, h, elastic_, job.parallel);
    // Plastic flow changes the stress.
    if (is_frame_sufficient(job.material) || job.material.plasticity)
        elastic_.take_state(job.neighbourhoods, job.material, configuration_of(job.phyxels), job.parallel);
}

// Computes the elastic force at the current positions and the stiffness damping at the velocity half a
// substep ago.
void ExplicitSolver::find_forces(const Job& job) {
    elastic_.forces(force_, job.parallel);
    if (!job.input.contacts.handle_springs.empty()) {
        const std::array<std::span<const Vec3>, 1> position = {job.phyxels.position};
        const std::array<std::span<Vec3>, 1> force = {force_};
        contacts_.add_handle_springs(position, force);
    }
    if (!(job.material.stiffness_damping > 0)) return;
    elastic_.apply_stiffness(job.material.stiffness_damping, zeros_, job.phyxels.velocity, damping_,
                             job.parallel, 0);
}

void ExplicitSolver::kick(const Job& job, double h) {
    const double damping_factor = std::exp(-job.material.mass_damping * h);
    gravity_time_ = (gravity_time_ + h) * damping_factor;
    for_phyxels(job.parallel, job.phyxels.size(), [&](std::size_t i) {
        if (held_[i] != 0) return;
        Vec3 acceleration = (force_[i] - damping_[i]) * inverse_mass_[i];
        if (!acceleration.allFinite()) {
            acceleration.setZero();
            failed_[i] = 1;
        }
        acceleration += job.input.gravity;
        job.phyxels.velocity[i] = (job.phyxels.velocity[i] + h * acceleration) * damping_factor;
    });
}

// Moves the phyxels. done: share of the step that is over afterwards.
void ExplicitSolver::drift(const Job& job, double h, double done) {
    Phyxels& phyxels = job.phyxels;
    for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
        if (held_[i] != 0) {
            const Vec3 displacement = job.input.held_position[i] - start_position_[i];
            phyxels.position[i] =
                done == 1 ? job.input.held_position[i] : Vec3(start_position_[i] + done * displacement);
            phyxels.velocity[i] = displacement / job.input.dt;
            return;
        }
        phyxels.position[i] += h * phyxels.velocity[i];
        if (!phyxels.position[i].allFinite()) {
            failed_[i] = 1;
            phyxels.position[i] = start_position_[i];
            phyxels.velocity[i].setZero();
        }
    });
    const std::array<std::span<Vec3>, 1> position = {phyxels.position};
    contacts_.separate_points(position, done);
}

void ExplicitSolver::restore_momenta(const Job& job) {
    for (std::size_t i = 0; i < job.phyxels.size(); ++i)
        if (held_[i] != 0 || failed_[i] != 0) momenta_.bind(job.phyxels.piece[i]);
    for (const HandleSpring& handle_spring : job.input.contacts.handle_springs)
        momenta_.bind(job.phyxels.piece[handle_spring.phyxel]);
    momenta_.join_touching(job.phyxels, job.input.contacts, 0);
    const double damping_factor = std::exp(-job.material.mass_damping * job.input.dt);
    if (damping_factor > 0)
        momenta_.restore(job.phyxels, damping_factor, gravity_time_ / damping_factor * job.input.gravity, {},
                         job.input.dt, job.parallel);
}

}  // namespace splitcubes::meshless
