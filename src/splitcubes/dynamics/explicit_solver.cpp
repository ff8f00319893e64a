#include <splitcubes/core/random.h>
#include <splitcubes/dynamics/explicit_solver.h>
#include <splitcubes/dynamics/tuning.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace splitcubes::meshless {

void ExplicitSolver::Group::clear() {
    jobs.clear();
    parts.clear();
    velocity.clear();
    force.clear();
    position.clear();
    touching.clear();
    changes = false;
    handle_work = 0;
}

void ExplicitSolver::Group::add(const Job& job) {
    ExplicitSolver& s = job.solver;
    jobs.push_back(job);
    parts.push_back({s.start_position_, s.effective_mass_, job.neighbourhoods.stiffness_diagonal(), s.held_});
    velocity.emplace_back(job.phyxels.velocity);
    force.emplace_back(s.force_);
    position.emplace_back(job.phyxels.position);
    touching.emplace_back(job.phyxels.touching);
    dt = job.input.dt;
    changes = changes || job.material.model == MaterialModel::st_venant_kirchhoff ||
              job.material.volume_stiffness > 0;
}

bool ExplicitSolver::step(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                          const StepInput& input, const SolverOptions& options, SolverReport& report,
                          const Parallel& parallel) {
    std::array<Member, 1> alone = {Member{*this, phyxels, neighbourhoods, material, input}};
    const bool done = step_together(alone, input.contacts, options, parallel);
    report = alone[0].report;
    return done;
}

bool ExplicitSolver::step_together(std::span<Member> members, const ContactInput& contacts,
                                   const SolverOptions& options, const Parallel& parallel) {
    Group& group = members[0].solver.group_;
    group.clear();
    group.handle_springs = contacts.handle_springs;
    for (Member& m : members) {
        check_step_input(m.phyxels, m.input);
        const Job job{m.solver,
                      m.phyxels,
                      m.neighbourhoods,
                      m.material,
                      m.input,
                      parallel,
                      std::max(options.refinement, 1)};
        m.solver.begin(job);
        group.add(job);
    }
    group.contacts.begin(contacts, group.parts, group.dt);
    for (const Job& job : group.jobs)
        job.solver.contact_work_.assign(
            contacts.contacts.empty() ? 0 : static_cast<std::size_t>(std::max(job.input.piece_count, 0)), 0);
    int substeps = 0;
    if (!group.take_substeps(substeps)) {
        for (const Job& job : group.jobs) job.solver.restore_start(job);
        return false;
    }
    group.finish();
    for (std::uint32_t k = 0; k < members.size(); ++k) {
        members[k].report = SolverReport{};
        members[k].report.substeps = substeps;
        members[k].solver.end(group.jobs[k], contacts, k, options.restore_momentum, members[k].report);
    }
    if (contacts.cached) members[0].report.contacts = contacts.cached->size();
    members[0].report.contact_energy = group.contacts.energy();
    members[0].report.work.handles = group.handle_work;
    return true;
}

void ExplicitSolver::Group::finish() {
    record_velocities();
    contacts.stop(position, velocity, 0.5 * last_substep);
    add_contact_work(DriftsAround::last);
    for (const std::span<std::uint8_t> flags : touching)
        std::fill(flags.begin(), flags.end(), std::uint8_t{0});
    contacts.finish(touching);
}

// Restores momenta, and writes the history and the report.
void ExplicitSolver::end(const Job& job, const ContactInput& contacts, std::uint32_t part,
                         bool restore_momentum, SolverReport& report) {
    Phyxels& phyxels = job.phyxels;
    if (restore_momentum) restore_momenta(job, contacts, part);
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        phyxels.previous_position[i] = start_position_[i];
        phyxels.previous_velocity[i] = start_velocity_[i];
        phyxels.restart_history[i] = held_[i] != 0 || failed_[i] != 0;
        report.non_finite += failed_[i];
    }
    phyxels.history_step = job.input.dt;
    describe_(phyxels, job.neighbourhoods, elastic_, report, job.parallel);
}

void ExplicitSolver::begin(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    const std::size_t n = phyxels.size();
    momenta_.begin(phyxels, job.input.piece_count, job.parallel);
    choose_masses(job);
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
    for (std::size_t i = 0; i < n; ++i) {
        if (held_[i] == 0) continue;
        const Vec3 displacement = job.input.held_position[i] - start_position_[i];
        job.phyxels.velocity[i] = displacement / job.input.dt;
        if (hold_work_.empty() && !displacement.isZero(0))
            hold_work_.assign(static_cast<std::size_t>(std::max(job.input.piece_count, 0)), 0);
    }
}

// Sets the masses that the phyxels move with. Selective mass scaling (Olovsson et al. 2005, here by phyxel):
// a cut leaves some phyxels light, or with neighbours on few sides, and one of them would set the substep of
// all.
void ExplicitSolver::choose_masses(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    const std::size_t n = phyxels.size();
    const std::span<const double> stiffness = job.neighbourhoods.stiffness_diagonal();
    double total = 0;
    std::vector<double>& ratio = effective_mass_;  // 1/s^2
    ratio.clear();
    for (std::size_t i = 0; i < n; ++i) {
        total += phyxels.mass[i];
        if (stiffness[i] > 0 && phyxels.mass[i] > 0) ratio.push_back(stiffness[i] / phyxels.mass[i]);
    }
    const double min_mass =
        total > 0 ? tuning::explicit_steps::min_mass_share * total / static_cast<double>(n) : 1;
    const auto middle = ratio.begin() + static_cast<std::ptrdiff_t>(ratio.size() / 2);
    if (!ratio.empty()) std::nth_element(ratio.begin(), middle, ratio.end());
    const double max_ratio = ratio.empty() ? std::numeric_limits<double>::infinity()
                                           : tuning::explicit_steps::max_stiffness_ratio * *middle;
    effective_mass_.resize(n);
    inverse_mass_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
        effective_mass_[i] = std::max({phyxels.mass[i], min_mass, stiffness[i] / max_ratio});
        inverse_mass_[i] = 1 / effective_mass_[i];
    }
}

// Records what restore_start needs beside positions and velocities.
void ExplicitSolver::save_start(const Job& job) {
    start_.rotation = job.phyxels.rotation;
    start_.deformation = job.phyxels.deformation;
    start_.plastic_strain = job.phyxels.plastic_strain;
}

// Undoes the substeps, which only materials whose stiffness changes can have taken.
void ExplicitSolver::restore_start(const Job& job) const {
    job.phyxels.position = start_position_;
    job.phyxels.velocity = start_velocity_;
    if (!start_.is_kept) return;
    job.phyxels.rotation = start_.rotation;
    job.phyxels.deformation = start_.deformation;
    job.phyxels.plastic_strain = start_.plastic_strain;
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
    elastic_.take_state(
        job.neighbourhoods, job.material,
        {job.phyxels.rest_position, job.phyxels.rest_position, job.phyxels.rotation, {}, false},
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
    // Also if it is not finite.
    if (!(needed_substeps <= tuning::explicit_steps::max_substeps_per_step))
        return tuning::explicit_steps::max_substeps_per_step + 1;
    return std::max(1, static_cast<int>(needed_substeps));
}

// Returns the largest number of substeps that a member needs.
int ExplicitSolver::Group::substeps_for(int before, int iterations) {
    int largest = 1;
    for (const Job& job : jobs) largest = std::max(largest, job.solver.substeps_for(job, before, iterations));
    return largest;
}

double ExplicitSolver::Group::largest_stretch() const {
    double largest = 0;
    for (const Job& job : jobs) largest = std::max(largest, job.solver.largest_stretch(job));
    return largest;
}

// Takes the whole step; returns false if it needs too many substeps. substeps: those that were taken.
bool ExplicitSolver::Group::take_substeps(int& substeps) {
    int per_step = 0;
    for (const Job& job : jobs) {
        const bool known = job.phyxels.history_step == dt;
        if (!is_frame_sufficient(job.material)) job.solver.draw_initial_mode(job);
        per_step =
            std::max(per_step, job.solver.substeps_for(job, known ? job.phyxels.substeps : 0,
                                                       tuning::explicit_steps::first_power_iterations));
        job.solver.start_.is_kept = false;
    }
    if (per_step > tuning::explicit_steps::max_substeps_per_step) return false;
    for (const Job& job : jobs) {
        if (changes) job.solver.save_start(job);
        job.solver.start_.is_kept = changes;
        job.solver.elastic_.take_state(job.neighbourhoods, job.material, configuration_of(job.phyxels),
                                       job.parallel);
        job.solver.elastic_.read_deformation(job.phyxels.deformation, job.phyxels.rotation, job.parallel);
    }
    find_forces();
    double done = 0;  // share of the step
    while (done < 1) {
        const int count = std::max(1, static_cast<int>(std::ceil((1 - done) * per_step - 1e-6)));
        const double share = (1 - done) / count;
        const double bound =
            changes ? tuning::explicit_steps::growth_between_estimates * largest_stretch() : 0;
        int k = 0;
        do {
            ++k;
            substep(share * dt, done + (k - 1) * share, k == count ? 1 : done + k * share);
        } while (k < count && (!changes || (k < tuning::explicit_steps::substeps_between_estimates &&
                                            largest_stretch() < bound)));
        substeps += k;
        done = k == count ? 1 : done + k * share;
        // Within a step substeps only become shorter.
        if (done < 1)
            per_step =
                std::max(per_step, substeps_for(per_step, tuning::explicit_steps::further_power_iterations));
        if (per_step > tuning::explicit_steps::max_substeps_per_step) return false;
    }
    for (const Job& job : jobs) {
        job.solver.elastic_.read_deformation(job.phyxels.deformation, job.phyxels.rotation, job.parallel);
        job.phyxels.substeps = per_step;
    }
    return true;
}

// Returns the largest |F|^2 of any phyxel; the stiffness of St. Venant-Kirchhoff grows with it.
double ExplicitSolver::largest_stretch(const Job& job) const {
    double largest = 0;
    for (const Mat3& F : job.phyxels.deformation) largest = std::max(largest, F.squaredNorm());
    return largest;
}

// before, after: shares of the step that are over.
void ExplicitSolver::Group::substep(double h, double before, double after) {
    for (const Job& job : jobs) {
        job.solver.add_hold_work(job, h);
        job.solver.kick(job, 0.5 * h);
    }
    // The impulses before the first drift are those of half a substep, like the kick.
    record_velocities();
    contacts.push(position, velocity, h, before > 0 ? h : 0.5 * h, before);
    add_contact_work(before > 0 ? DriftsAround::both : DriftsAround::next);
    last_substep = h;
    if (!handle_springs.empty()) handle_work += 0.5 * h * contacts.handle_power(velocity);
    for (const Job& job : jobs) {
        job.solver.drift(job, h, after);
        job.solver.deform(job, h);
    }
    find_forces();
    if (!handle_springs.empty()) handle_work += 0.5 * h * contacts.handle_power(velocity);
    for (const Job& job : jobs) {
        job.solver.add_hold_work(job, h);
        job.solver.kick(job, 0.5 * h);
    }
}

void ExplicitSolver::Group::record_velocities() {
    for (std::uint32_t k = 0; k < jobs.size(); ++k) {
        std::vector<Vec3>& before = jobs[k].solver.velocity_before_;
        before.clear();
        for (const std::uint32_t i : contacts.touched(k)) before.push_back(velocity[k][i]);
    }
}

// Counts the work of the impulses since record_velocities: they act between two drifts, like the other
// forces of leapfrog. At the start and the end of a step there is one.
void ExplicitSolver::Group::add_contact_work(DriftsAround drifts) {
    for (std::uint32_t k = 0; k < jobs.size(); ++k) {
        const Phyxels& phyxels = jobs[k].phyxels;
        ExplicitSolver& s = jobs[k].solver;
        const std::span<const std::uint32_t> touched = contacts.touched(k);
        s.drift_velocity_.resize(touched.size());
        for (std::size_t n = 0; n < touched.size(); ++n) {
            const std::uint32_t i = touched[n];
            const Vec3 after = velocity[k][i], change = after - s.velocity_before_[n];
            const Vec3 mean = drifts == DriftsAround::next   ? after
                              : drifts == DriftsAround::last ? s.drift_velocity_[n]
                                                             : Vec3(0.5 * (s.drift_velocity_[n] + after));
            s.drift_velocity_[n] = after;
            const auto piece = static_cast<std::size_t>(phyxels.piece[i]);
            const double work = phyxels.mass[i] * change.dot(mean);
            if (s.held_[i] == 0 && piece < s.contact_work_.size() && std::isfinite(work))
                s.contact_work_[piece] += work;
        }
    }
}

void ExplicitSolver::Group::find_forces() {
    for (const Job& job : jobs) job.solver.find_forces(job);
    if (!handle_springs.empty()) contacts.add_handle_springs(position, force);
}

void ExplicitSolver::deform(const Job& job, double h) {
    SlicedElasticity::Configuration now = configuration_of(job.phyxels);
    // Tangents cost more than stresses.
    now.has_tangents = job.material.stiffness_damping > 0;
    elastic_.take_state(job.neighbourhoods, job.material, now, job.parallel);
    if (is_frame_sufficient(job.material)) return;
    const DeformationChange change =
        deform_and_flow(job.phyxels, job.neighbourhoods, job.material, h, elastic_, job.parallel, true);
    if (!change.flowed) return;
    elastic_.take_state(job.neighbourhoods, job.material, now, job.parallel);
}

// Computes the elastic force at the current positions and the stiffness damping at the velocity half a
// substep ago.
void ExplicitSolver::find_forces(const Job& job) {
    elastic_.forces(force_, job.parallel);
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
            return;
        }
        phyxels.position[i] += h * phyxels.velocity[i];
        if (!phyxels.position[i].allFinite()) {
            failed_[i] = 1;
            phyxels.position[i] = start_position_[i];
            phyxels.velocity[i].setZero();
        }
    });
}

void ExplicitSolver::restore_momenta(const Job& job, const ContactInput& contacts, std::uint32_t part) {
    for (std::size_t i = 0; i < job.phyxels.size(); ++i)
        if (held_[i] != 0 || failed_[i] != 0) momenta_.bind(job.phyxels.piece[i]);
    for (const HandleSpring& handle_spring : contacts.handle_springs)
        if (handle_spring.part == part) momenta_.bind(job.phyxels.piece[handle_spring.phyxel]);
    momenta_.join_touching(job.phyxels, contacts, part);
    const double damping_factor = std::exp(-job.material.mass_damping * job.input.dt);
    if (damping_factor > 0)
        momenta_.restore(job.phyxels, damping_factor, gravity_time_ / damping_factor * job.input.gravity, {},
                         job.input.dt, job.parallel);
}

}  // namespace splitcubes::meshless
