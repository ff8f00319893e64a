#include <splitcubes/dynamics/energy_guard.h>
#include <splitcubes/dynamics/tuning.h>
#include <splitcubes/math/decompose.h>
#include <splitcubes/samples/loops.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::meshless {

namespace {

bool is_held(const StepInput& input, std::size_t i) {
    return !input.held.empty() && input.held[i] != 0;
}

Mat3 turn_by(const Vec3& rotation) {
    const double angle = rotation.norm();
    if (!(angle > 0)) return Mat3::Identity();
    return Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix();
}

}  // namespace

// Adds a phyxel to an account. gravity: adds the work of gravity since begin. A touching phyxel gets no
// negative work: being lifted costs it nothing.
void EnergyGuard::add_phyxel(const Phyxels& phyxels, const StepInput& input, bool gravity, std::size_t i,
                             Account& account) const {
    const double m = phyxels.mass[i];
    const double kinetic = 0.5 * m * phyxels.velocity[i].squaredNorm();
    account.mass += m;
    account.volume += phyxels.volume[i];
    account.total_kinetic += kinetic;
    account.elastic += phyxels.elastic_energy[i];
    account.reserve += phyxels.reserve[i];
    account.touches |= phyxels.touching[i] != 0;
    if (is_held(input, i)) {
        const Vec3 displacement = input.held_position[i] - position_[i];
        account.add_hold(displacement, m);
        // A hold that stops what moves does no work.
        if (gravity && !displacement.isZero(0))
            account.held_work +=
                kinetic - 0.5 * m * velocity_[i].squaredNorm() - m * input.gravity.dot(displacement);
        return;
    }
    account.free_kinetic += kinetic;
    account.linear += m * phyxels.velocity[i];
    if (!gravity) return;
    const double work = m * input.gravity.dot(phyxels.position[i] - position_[i]);
    if (phyxels.touching[i] == 0 || work > 0) account.work += work;
}

void EnergyGuard::Account::add_hold(const Vec3& displacement, double m) {
    if (!(held_mass > 0)) held_displacement = displacement;
    has_uniform_hold &= (displacement - held_displacement).norm() <=
                        tuning::energy::same_displacement_share * held_displacement.norm();
    held_moves |= !displacement.isZero(0);
    held_mass += m;
}

EnergyGuard::Account& EnergyGuard::Account::operator+=(const Account& other) {
    mass += other.mass;
    volume += other.volume;
    linear += other.linear;
    total_kinetic += other.total_kinetic;
    free_kinetic += other.free_kinetic;
    elastic += other.elastic;
    reserve += other.reserve;
    work += other.work;
    held_work += other.held_work;
    touches |= other.touches;
    if (other.held_mass > 0) {
        const bool moved = held_moves || other.held_moves;
        add_hold(other.held_displacement, other.held_mass);
        has_uniform_hold &= other.has_uniform_hold;
        held_moves = moved;
    }
    return *this;
}

// Sums the accounts; prepare(i) is called before phyxel i is added.
template <class Prepare>
void EnergyGuard::sum_accounts(const Phyxels& phyxels, const StepInput& input, bool gravity,
                               std::vector<Account>& accounts, const Parallel& parallel,
                               const Prepare& prepare) {
    constexpr std::size_t grain = 1024;
    const std::size_t pieces = accounts.size(), chunks = (phyxels.size() + grain - 1) / grain;
    const auto add = [&](std::size_t begin, std::size_t end, Account* sums) {
        for (std::size_t i = begin; i < end; ++i)
            if (is_counted(phyxels, i)) add_phyxel(phyxels, input, gravity, i, sums[slot(phyxels, i)]);
    };
    // With many pieces, adding the chunks' accounts costs more than it saves.
    if (chunks < 2 || pieces > 64) {
        for_phyxels(parallel, phyxels.size(), prepare);
        return add(0, phyxels.size(), accounts.data());
    }
    chunk_accounts_.assign(chunks * pieces, Account{});
    const auto chunk = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) prepare(i);
        add(begin, end, chunk_accounts_.data() + begin / grain * pieces);
    };
    parallel.for_chunks(phyxels.size(), grain, std::cref(chunk));
    for (std::size_t k = 0; k < chunk_accounts_.size(); ++k) accounts[k % pieces] += chunk_accounts_[k];
}

// Sums the accounts after the step into end_.
void EnergyGuard::sum_end_accounts(const Phyxels& phyxels, const StepInput& input, bool gravity,
                                   const Parallel& parallel) {
    end_.assign(start_.size(), Account{});
    sum_accounts(phyxels, input, gravity, end_, parallel, [](std::size_t) {});
}

void EnergyGuard::begin(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                        const Material& material, const StepInput& input, const Parallel& parallel) {
    const std::size_t n = phyxels.size();
    for (auto* array : {&position_, &velocity_}) array->resize(n);
    rotation_.resize(n);
    if (material.plasticity) plastic_strain_ = phyxels.plastic_strain;
    touching_ = phyxels.touching;
    start_.assign(static_cast<std::size_t>(std::max(input.piece_count, 0)), Account{});
    extra_work_.assign(start_.size(), 0);
    contacts_.assign(start_.size(), ContactSum{});
    sum_accounts(phyxels, input, false, start_, parallel, [&](std::size_t i) {
        position_[i] = phyxels.position[i];
        velocity_[i] = phyxels.velocity[i];
        rotation_[i] = phyxels.rotation[i];
    });
    if (phyxels.history_step > 0) return;
    // Before the first step the elastic energy of the initial state counts as available.
    rows_.resize(phyxels.size());
    elastic_.take_state(neighbourhoods, material, configuration_of(phyxels), parallel);
    elastic_.energy(configuration_of(phyxels), parallel, rows_);
    const std::vector<double>& elastic = elastic_by_piece(phyxels, rows_);
    for (std::size_t k = 0; k < start_.size(); ++k) start_[k].elastic = elastic[k];
}

void EnergyGuard::add_work(std::int32_t piece, double work) {
    if (piece >= 0 && static_cast<std::size_t>(piece) < extra_work_.size())
        extra_work_[static_cast<std::size_t>(piece)] += work;
}

void EnergyGuard::count_contacts(const Phyxels& phyxels, const StepInput& input, const ContactInput& contacts,
                                 std::uint32_t part, std::span<const double> contact_work) {
    contacts_.assign(start_.size(), ContactSum{});
    for (std::size_t k = 0; k < std::min(contact_work.size(), contacts_.size()); ++k)
        contacts_[k].work = contact_work[k];
    const auto add = [&](const ContactSide& side, const Vec3& force) {
        if (side.part != part || side.count == 0 || !is_counted(phyxels, side.phyxel[0])) return;
        // What acts on held phyxels is borne by the hold.
        Vec3 displacement = Vec3::Zero(), held_displacement = Vec3::Zero();
        double share = 0;
        for (std::uint32_t k = 0; k < side.count; ++k) {
            const std::uint32_t i = side.phyxel[k];
            const Vec3 moved = side.weight[k] * (phyxels.position[i] - position_[i]);
            (is_held(input, i) ? held_displacement : displacement) += moved;
            if (!is_held(input, i)) share += side.weight[k];
        }
        ContactSum& sum = contacts_[slot(phyxels, side.phyxel[0])];
        sum.work_on_held += force.dot(held_displacement);
        if (!contact_work.empty()) return;
        const double work = force.dot(displacement);
        sum.work += work + tuning::energy::work_slack * std::abs(work);
        sum.force += share * force;
    };
    CachedContactFinder finder(contacts.cached);
    for (const Contact& contact : contacts.contacts) {
        const CachedContact* const cached = finder.find(contact.key);
        if (cached == nullptr) continue;
        add(contact.upper, cached->force);
        add(contact.lower, -cached->force);
    }
    count_handles(phyxels, input, contacts, part);
}

// Adds the forces of handles after the step, which holds bear; their work is not known piece by piece.
void EnergyGuard::count_handles(const Phyxels& phyxels, const StepInput& input, const ContactInput& contacts,
                                std::uint32_t part) {
    if (contacts.handle_springs.empty()) return;
    force_.assign(contacts.handle_force_limits.size(), Vec3::Zero());
    const auto force_of = [&](const HandleSpring& spring) {
        return Vec3(spring.stiffness * (spring.target - phyxels.position[spring.phyxel]));
    };
    const auto acts = [&](const HandleSpring& spring) {
        return spring.part == part && is_counted(phyxels, spring.phyxel) && !is_held(input, spring.phyxel);
    };
    for (const HandleSpring& spring : contacts.handle_springs)
        if (acts(spring)) force_[spring.handle] += force_of(spring);
    for (const HandleSpring& spring : contacts.handle_springs) {
        if (!acts(spring)) continue;
        const double share =
            share_within_limit(force_[spring.handle], contacts.handle_force_limits[spring.handle]);
        ContactSum& sum = contacts_[slot(phyxels, spring.phyxel)];
        sum.force += share * force_of(spring);
        sum.work = std::numeric_limits<double>::infinity();
    }
}

std::vector<double>& EnergyGuard::elastic_by_piece(const Phyxels& phyxels, std::span<const double> rows) {
    sum_.assign(start_.size(), 0);
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (is_counted(phyxels, i)) sum_[slot(phyxels, i)] += rows[i];
    return sum_;
}

// Returns the work of a hold that only translates its phyxels: the change of momentum of the free phyxels,
// minus gravity, damping and contacts, is its impulse. This is exact for any internal forces.
double EnergyGuard::uniform_hold_work(const Material& material, const StepInput& input, std::size_t k) const {
    const Account& start = start_[k];
    const double mass = start.mass - start.held_mass;
    const Vec3 damping = 0.5 * material.mass_damping * (start.linear + end_[k].linear);
    const Vec3 force =
        (end_[k].linear - start.linear) / input.dt + damping - mass * input.gravity - contacts_[k].force;
    return force.dot(start.held_displacement);
}

// Computes the work of the holds as the larger of the values by the forces before and after the step: an
// implicit step uses the force at its end, and that of an unfinished solve lies between.
void EnergyGuard::find_hold_work(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                 const Material& material, const StepInput& input, const Parallel& parallel) {
    force_.resize(phyxels.size());
    const auto work_at = [&](const SlicedElasticity::Configuration& configuration,
                             std::vector<double>& work) {
        elastic_.take_state(neighbourhoods, material, configuration, parallel);
        elastic_.forces(force_, parallel);
        work.assign(start_.size(), 0);
        for (std::size_t i = 0; i < phyxels.size(); ++i)
            if (is_counted(phyxels, i) && is_held(input, i))
                work[slot(phyxels, i)] -= force_[i].dot(input.held_position[i] - position_[i]);
    };
    work_at({phyxels.rest_position, position_, rotation_,
             material.plasticity ? std::span<const Mat3>(plastic_strain_) : std::span<const Mat3>()},
            hold_work_);
    work_at(configuration_of(phyxels), scratch_);
    for (std::size_t k = 0; k < hold_work_.size(); ++k) hold_work_[k] = std::max(hold_work_[k], scratch_[k]);
}

// Returns whether a piece is held, touches something, or its momentum changed by more than gravity and mass
// damping explain.
bool EnergyGuard::was_pushed(const Material& material, const StepInput& input, std::size_t k) const {
    const Account& start = start_[k];
    if (start.held_mass > 0 || start.touches || end_[k].touches) return true;
    const Vec3 gravity_impulse = input.dt * start.mass * input.gravity;
    const double size = start.linear.norm() + gravity_impulse.norm();
    const double damping_share = std::min(1.0, material.mass_damping * input.dt);
    const double rounding = 1e-9 * std::sqrt(2 * start.mass * start.total_kinetic);
    return !((end_[k].linear - start.linear - gravity_impulse).norm() <=
             (tuning::energy::push_share + damping_share) * size + rounding);
}

EnergyGuard::Balance EnergyGuard::find_balance(const Material& material, const StepInput& input,
                                               double tolerance, std::size_t k) const {
    const Account& start = start_[k];
    const Account& end = end_[k];
    Balance balance;
    balance.is_isolated = !was_pushed(material, input, k);
    double kinetic_before = start.free_kinetic, kinetic = end.free_kinetic;
    if (balance.is_isolated) {
        kinetic_before -= start.linear.squaredNorm() / (2 * start.mass);
        kinetic -= end.linear.squaredNorm() / (2 * end.mass);
    } else {
        kinetic_before += end.work;
    }
    kinetic_before = balance.is_isolated ? std::max(kinetic_before, 0.0) : kinetic_before;
    balance.budget = kinetic_before + start.elastic + start.reserve + extra_work_[k] + contacts_[k].work;
    const double noise =
        tuning::energy::noise_strain * tuning::energy::noise_strain * material.youngs_modulus * start.volume;
    balance.limit = balance.budget + tuning::energy::motion_share * std::max(kinetic_before, 0.0) +
                    tolerance * std::max(start.elastic, std::min(end.elastic, balance.budget)) + noise;
    balance.energy = kinetic + end.elastic;
    balance.has_excess = !(balance.energy <= balance.limit);
    return balance;
}

bool EnergyGuard::evaluate(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                           const Material& material, const StepInput& input,
                           const tuning::energy::Tolerance& tolerance, std::span<const double> hold_work,
                           const Parallel& parallel) {
    reserve_kept_ = {tolerance.apart_reserve_kept, tolerance.reserve_kept};
    balance_.assign(start_.size(), Balance{});
    sum_end_accounts(phyxels, input, true, parallel);
    evaluation_.any_excess = false;
    evaluation_.work_of_holds = 0;
    bool holds_are_known = false;
    for (std::size_t k = 0; k < start_.size(); ++k) {
        if (!(start_[k].mass > 0)) continue;
        evaluation_.work_of_holds += end_[k].held_work - contacts_[k].work_on_held;
        const auto count_work = [&](double work) {
            end_[k].work += work;
            evaluation_.work_of_holds += work;
            balance_[k] = find_balance(material, input, tolerance.elastic_share, k);
        };
        count_work(start_[k].held_moves && !hold_work.empty() ? hold_work[k] : 0);
        if (start_[k].held_moves && hold_work.empty()) {
            const bool is_uniform = start_[k].has_uniform_hold;
            const double uniform_work = is_uniform ? uniform_hold_work(material, input, k) : 0;
            if (is_uniform) count_work(uniform_work);
            // Momentum tells the work of a hold only as well as the mean force of contacts is known.
            const bool is_exact = is_uniform && contacts_[k].force.isZero(0);
            const bool is_within =
                std::isfinite(balance_[k].budget) && balance_[k].energy <= balance_[k].budget;
            if (!is_exact && !is_within) {
                if (!holds_are_known) find_hold_work(phyxels, neighbourhoods, material, input, parallel);
                holds_are_known = true;
                count_work(is_uniform ? std::max(hold_work_[k] - uniform_work, 0.0) : hold_work_[k]);
            }
        }
        evaluation_.any_excess = evaluation_.any_excess || balance_[k].has_excess;
    }
    if (!evaluation_.any_excess) return false;
    find_rigid_motions(phyxels, parallel);
    const bool is_strained = find_excess_strain(phyxels, neighbourhoods, material, parallel);
    const double repeat_share = tolerance.repeat_share;
    return is_strained || std::any_of(balance_.begin(), balance_.end(), [&](const Balance& balance) {
               return balance.has_excess &&
                      balance.energy - balance.limit > repeat_share * std::abs(balance.budget);
           });
}

// Finds pieces whose elastic energy exceeds both what the budget allows and that of the start positions with
// the current links: finer steps do not help against energy that a cut added. Returns whether there are any.
bool EnergyGuard::find_excess_strain(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                     const Material& material, const Parallel& parallel) {
    bool any = false;
    for (std::size_t k = 0; k < start_.size(); ++k) {
        Balance& balance = balance_[k];
        if (!balance.has_excess) continue;
        balance.max_elastic =
            balance.limit + tuning::energy::excess_strain_share * std::abs(balance.budget) - rigid_energy(k);
        balance.has_excess_strain = !(end_[k].elastic <= balance.max_elastic);
        any = any || balance.has_excess_strain;
    }
    if (!any) return false;
    rows_.resize(phyxels.size());
    const std::span<const Mat3> plastic =
        material.plasticity ? std::span<const Mat3>(plastic_strain_) : std::span<const Mat3>();
    const SlicedElasticity::Configuration start{phyxels.rest_position, position_, rotation_, plastic};
    elastic_.take_state(neighbourhoods, material, start, parallel);
    elastic_.energy(start, parallel, rows_);
    const std::vector<double>& elastic = elastic_by_piece(phyxels, rows_);
    any = false;
    for (std::size_t k = 0; k < start_.size(); ++k) {
        Balance& balance = balance_[k];
        if (!balance.has_excess_strain) continue;
        balance.max_elastic = std::max(balance.max_elastic, (1 + tuning::energy::strain_slack) * elastic[k]);
        balance.has_excess_strain = !(end_[k].elastic <= balance.max_elastic);
        any = any || balance.has_excess_strain;
    }
    return any;
}

void EnergyGuard::find_rigid_motions(const Phyxels& phyxels, const Parallel& parallel) {
    momenta_of_pieces(phyxels, static_cast<int>(start_.size()), after_, partial_, parallel);
}

// Returns the kinetic energy of the rigid motion, J; zero for a held piece.
double EnergyGuard::rigid_energy(std::size_t k) const {
    if (start_[k].held_mass > 0) return 0;
    const Momenta& current = after_[k];
    const double angular_momentum =
        0.5 * current.angular_momentum.dot(angular_velocity(current.inertia, current.angular_momentum));
    return balance_[k].is_isolated ? angular_momentum
                                   : angular_momentum + current.linear.squaredNorm() / (2 * current.mass);
}

void EnergyGuard::restore_start(Phyxels& phyxels) const {
    phyxels.position = position_;
    phyxels.velocity = velocity_;
    phyxels.rotation = rotation_;
    if (plastic_strain_.size() == phyxels.size()) phyxels.plastic_strain = plastic_strain_;
    phyxels.touching = touching_;
}

void EnergyGuard::reset_history(Phyxels& phyxels, double dt) const {
    phyxels.previous_position = position_;
    phyxels.previous_velocity = velocity_;
    phyxels.history_step = dt;
    std::fill(phyxels.restart_history.begin(), phyxels.restart_history.end(), std::uint8_t{1});
}

// Places the phyxels of relaxing pieces at their share of the deformation of the step, and computes their
// elastic energies. Plastic flow is kept with the whole deformation only.
void EnergyGuard::interpolate_positions(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                        const Material& material, const StepInput& input,
                                        const Parallel& parallel) {
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (!is_counted(phyxels, i)) continue;
        const std::size_t k = slot(phyxels, i);
        const Relaxation& relaxation = relaxation_[k];
        if (!relaxation.is_open) continue;
        if (material.plasticity)
            phyxels.plastic_strain[i] =
                relaxation.share < 1 ? plastic_strain_[i] : solution_.plastic_strain[i];
        if (is_held(input, i)) continue;
        Vec3 rigid_value = position_[i];
        if (start_[k].held_mass <= 0) {
            const Vec3 rotation_rate = angular_velocity(before_[k].inertia, before_[k].angular_momentum);
            rigid_value =
                after_[k].centre + turn_by(input.dt * rotation_rate) * (position_[i] - before_[k].centre);
        } else if (start_[k].has_uniform_hold) {
            rigid_value += start_[k].held_displacement;
        }
        phyxels.position[i] =
            relaxation.share > 0
                ? Vec3(rigid_value + relaxation.share * (solution_.position[i] - rigid_value))
                : rigid_value;
    }
    elastic_.take_state(neighbourhoods, material, configuration_of(phyxels), parallel);
    elastic_.energy(configuration_of(phyxels), parallel, phyxels.elastic_energy);
    const std::vector<double>& elastic = elastic_by_piece(phyxels, phyxels.elastic_energy);
    for (std::size_t k = 0; k < relaxation_.size(); ++k)
        if (relaxation_[k].is_open) end_[k].elastic = elastic[k];
}

// Removes the deformation of the step by halves in pieces with excess strain. Where that does not reach the
// allowed energy, as a hold that does not move as a rigid body strains a piece that stays behind, the share
// with the least energy is taken.
void EnergyGuard::relax_excess_strain(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                      const Material& material, const StepInput& input,
                                      const Parallel& parallel) {
    relaxation_.assign(start_.size(), Relaxation{});
    for (std::size_t k = 0; k < start_.size(); ++k) {
        relaxation_[k].is_open = balance_[k].has_excess_strain;
        relaxation_[k].least_elastic = end_[k].elastic;
    }
    bool any = true;
    solution_.position = phyxels.position;
    if (material.plasticity) solution_.plastic_strain = phyxels.plastic_strain;
    std::swap(phyxels.position, position_);
    std::swap(phyxels.velocity, velocity_);
    momenta_of_pieces(phyxels, static_cast<int>(start_.size()), before_, partial_, parallel);
    std::swap(phyxels.position, position_);
    std::swap(phyxels.velocity, velocity_);
    double share = 1;
    for (int k = 0; k <= tuning::energy::max_halvings && any; ++k) {
        share = k < tuning::energy::max_halvings ? 0.5 * share : 0;
        for (Relaxation& relaxation : relaxation_) relaxation.share = share;
        interpolate_positions(phyxels, neighbourhoods, material, input, parallel);
        any = false;
        for (std::size_t p = 0; p < start_.size(); ++p) {
            Relaxation& relaxation = relaxation_[p];
            if (!relaxation.is_open) continue;
            if (end_[p].elastic < relaxation.least_elastic) {
                relaxation.least_elastic = end_[p].elastic;
                relaxation.best_share = share;
            }
            relaxation.is_open = !(end_[p].elastic <= balance_[p].max_elastic);
            any = any || relaxation.is_open;
        }
    }
    if (any) {
        for (Relaxation& relaxation : relaxation_) relaxation.share = relaxation.best_share;
        interpolate_positions(phyxels, neighbourhoods, material, input, parallel);
    }
    elastic_.read_deformation(phyxels.deformation, phyxels.rotation, parallel);
}

// Scales the non-rigid velocities of pieces with an excess to what the limit allows.
void EnergyGuard::scale_velocities(Phyxels& phyxels, const StepInput& input) {
    scratch_.assign(start_.size(), 1);
    for (std::size_t k = 0; k < start_.size(); ++k) {
        Balance& balance = balance_[k];
        if (!balance.has_excess) continue;
        const double rigid = rigid_energy(k);
        const double inner = balance.energy - end_[k].elastic - rigid;
        const double available = balance.limit - end_[k].elastic - rigid;
        scratch_[k] = inner > 0 && available > 0 ? std::sqrt(std::min(available / inner, 1.0)) : 0;
        if (balance.has_excess_strain) scratch_[k] = 0;
    }
    before_.assign(start_.size(), Momenta{});  // rigid velocities: linear m/s, angular_momentum rad/s
    for (std::size_t k = 0; k < start_.size(); ++k) {
        if (!balance_[k].has_excess) continue;
        if (start_[k].held_mass > 0) {
            // A relaxed piece moves with what holds it.
            if (balance_[k].has_excess_strain && start_[k].has_uniform_hold)
                before_[k].linear = start_[k].held_displacement / input.dt;
            continue;
        }
        before_[k].linear = after_[k].linear / after_[k].mass;
        before_[k].angular_momentum = angular_velocity(after_[k].inertia, after_[k].angular_momentum);
    }
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (!is_counted(phyxels, i) || is_held(input, i)) continue;
        const std::size_t k = slot(phyxels, i);
        if (!balance_[k].has_excess) continue;
        const Vec3 rigid_value =
            before_[k].linear + before_[k].angular_momentum.cross(phyxels.position[i] - after_[k].centre);
        const Vec3 inner = phyxels.velocity[i] - rigid_value;
        phyxels.velocity[i] = scratch_[k] > 0 ? Vec3(rigid_value + scratch_[k] * inner) : rigid_value;
        phyxels.restart_history[i] = 1;
    }
}

void EnergyGuard::enforce(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                          const StepInput& input, SolverReport& report, const Parallel& parallel) {
    report.work.holds += std::isfinite(evaluation_.work_of_holds) ? evaluation_.work_of_holds : 0;
    if (evaluation_.any_excess) {
        const double before = report.kinetic_energy + report.elastic_energy;
        bool has_excess_strain = false;
        for (const Balance& balance : balance_) {
            report.energy_excess_pieces += balance.has_excess;
            has_excess_strain = has_excess_strain || balance.has_excess_strain;
        }
        if (has_excess_strain) {
            relax_excess_strain(phyxels, neighbourhoods, material, input, parallel);
            // Momenta are kept, now about the new centres of mass.
            const std::vector<Momenta> momenta = after_;
            find_rigid_motions(phyxels, parallel);
            for (std::size_t k = 0; k < momenta.size(); ++k) {
                after_[k].linear = momenta[k].linear;
                after_[k].angular_momentum = momenta[k].angular_momentum;
            }
        }
        scale_velocities(phyxels, input);
        elastic_.take_state(neighbourhoods, material, configuration_of(phyxels), parallel);
        report.inverted = report.rank_deficient = 0;
        report.kinetic_energy = 0;
        describe_(phyxels, neighbourhoods, elastic_, report, parallel);
        const double removed = before - report.kinetic_energy - report.elastic_energy;
        report.energy_removed += std::isfinite(removed) ? std::max(removed, 0.0) : 0;
        sum_end_accounts(phyxels, input, false, parallel);
    }
    write_reserves(phyxels, parallel);
}

// Writes the reserves. A surplus is distributed by mass, so that it follows the parts when a piece splits; a
// deficit is distributed by elastic energy, which is where a cut added it.
void EnergyGuard::write_reserves(Phyxels& phyxels, const Parallel& parallel) {
    sum_.assign(start_.size(), 0);
    for (std::size_t k = 0; k < start_.size(); ++k) {
        if (!(start_[k].mass > 0) || !std::isfinite(balance_[k].budget)) continue;
        double current = end_[k].free_kinetic + end_[k].elastic;
        if (balance_[k].is_isolated) current -= end_[k].linear.squaredNorm() / (2 * end_[k].mass);
        // More than the elastic energy cannot be taken back: a larger deficit would stop the piece for good.
        // The piece owes the tolerated excess, so that excesses do not add up.
        const double tolerated = std::max(balance_[k].limit - balance_[k].budget, 0.0);
        const double unspent = std::max(balance_[k].budget - current, -end_[k].elastic - tolerated);
        const bool has_deficit = unspent < 0 && end_[k].elastic > 0;
        const bool touches = start_[k].touches || end_[k].touches || contacts_[k].work != 0;
        const double kept = reserve_kept_[touches ? 1 : 0];
        sum_[k] = has_deficit ? unspent / end_[k].elastic
                              : (unspent > 0 ? kept * unspent : unspent) / start_[k].mass;
    }
    for_phyxels(parallel, phyxels.size(), [&](std::size_t i) {
        phyxels.reserve[i] = 0;
        if (!is_counted(phyxels, i)) return;
        const std::size_t k = slot(phyxels, i);
        const bool has_deficit = sum_[k] < 0 && end_[k].elastic > 0;
        const double share = sum_[k] * (has_deficit ? phyxels.elastic_energy[i] : phyxels.mass[i]);
        if (std::isfinite(share)) phyxels.reserve[i] = share;
    });
}

}  // namespace splitcubes::meshless
