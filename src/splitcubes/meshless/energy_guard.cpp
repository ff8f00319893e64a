#include <splitcubes/math/decompose.h>
#include <splitcubes/meshless/energy_guard.h>
#include <splitcubes/meshless/loops.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::meshless {

namespace {

// Strain that single precision cannot tell from none, of all of a piece.
constexpr double noise_strain = 1e-5;
// Share of the kinetic energy about the centre that rounding and the unfinished solve may add.
constexpr double motion_share = 1e-3;
// Share of what is unspent that the reserve keeps from step to step.
constexpr double reserve_kept = 0.9;
// Change of a momentum, relative to its own size, that says that something pushed.
constexpr double push_share = 1e-6;
// Share of the budget by which the elastic energy may exceed it before the step is taken
// again: less is left of unfinished solves, and later steps pay for it.
constexpr double debt_share = 0.05;
// Differences of ways, relative to their length, that are rounding.
constexpr double same_way = 1e-6;
// Halvings of the deformation of a step before none of it is left.
constexpr int halvings = 4;
// Elastic energy that a piece may keep above that before the step, as a share of it.
constexpr double strain_slack = 0.05;
// Share of a contact's work by which it may differ from what its force at the end tells.
constexpr double work_slack = 0.02;

bool is_held(const StepInput& input, std::size_t i) {
    return !input.held.empty() && input.held[i] != 0;
}

Mat3 turn_by(const Vec3& rotation) {
    const double angle = rotation.norm();
    if (!(angle > 0)) return Mat3::Identity();
    return Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix();
}

}  // namespace

// gravity: it has done its work on the way from where begin found the phyxels. What lies on something falls
// onto it no further: lifting it costs nothing.
void EnergyGuard::add_phyxel(const Phyxels& phyxels, const StepInput& input, bool gravity, std::size_t i,
                             Account& account) const {
    const double m = phyxels.mass[i];
    const double kinetic = 0.5 * m * phyxels.velocity[i].squaredNorm();
    account.mass += m;
    account.volume += phyxels.volume[i];
    account.all_kinetic += kinetic;
    account.elastic += phyxels.elastic_energy[i];
    account.reserve += phyxels.reserve[i];
    account.touches |= phyxels.touching[i] != 0;
    if (is_held(input, i)) {
        account.add_hold(input.held_position[i] - position_[i], m);
        return;
    }
    account.loose_kinetic += kinetic;
    account.linear += m * phyxels.velocity[i];
    if (!gravity) return;
    const double work = m * input.gravity.dot(phyxels.position[i] - position_[i]);
    if (phyxels.touching[i] == 0 || work > 0) account.work += work;
}

void EnergyGuard::Account::add_hold(const Vec3& way, double m) {
    if (!(held_mass > 0)) held_way = way;
    one_way &= (way - held_way).norm() <= same_way * held_way.norm();
    held_moves |= !way.isZero(0);
    held_mass += m;
}

EnergyGuard::Account& EnergyGuard::Account::operator+=(const Account& other) {
    mass += other.mass;
    volume += other.volume;
    linear += other.linear;
    all_kinetic += other.all_kinetic;
    loose_kinetic += other.loose_kinetic;
    elastic += other.elastic;
    reserve += other.reserve;
    work += other.work;
    touches |= other.touches;
    if (other.held_mass > 0) {
        const bool moved = held_moves || other.held_moves;
        add_hold(other.held_way, other.held_mass);
        one_way &= other.one_way;
        held_moves = moved;
    }
    return *this;
}

// first(i) is done before phyxel i is added.
template <class First>
void EnergyGuard::sum_up(const Phyxels& phyxels, const StepInput& input, bool gravity,
                         std::vector<Account>& accounts, const Parallel& parallel, const First& first) {
    constexpr std::size_t grain = 1024;
    const std::size_t pieces = accounts.size(), chunks = (phyxels.size() + grain - 1) / grain;
    const auto add = [&](std::size_t begin, std::size_t end, Account* sums) {
        for (std::size_t i = begin; i < end; ++i)
            if (is_counted(phyxels, i)) add_phyxel(phyxels, input, gravity, i, sums[slot(phyxels, i)]);
    };
    // With many pieces the chunks' sums would cost more than they save.
    if (chunks < 2 || pieces > 64) {
        for_phyxels(parallel, phyxels.size(), first);
        return add(0, phyxels.size(), accounts.data());
    }
    chunk_accounts_.assign(chunks * pieces, Account{});
    const auto chunk = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) first(i);
        add(begin, end, chunk_accounts_.data() + begin / grain * pieces);
    };
    parallel.for_chunks(phyxels.size(), grain, std::cref(chunk));
    for (std::size_t k = 0; k < chunk_accounts_.size(); ++k) accounts[k % pieces] += chunk_accounts_[k];
}

// What the pieces have after the step, into end_.
void EnergyGuard::sum_up_step(const Phyxels& phyxels, const StepInput& input, bool gravity,
                              const Parallel& parallel) {
    end_.assign(start_.size(), Account{});
    sum_up(phyxels, input, gravity, end_, parallel, [](std::size_t) {});
}

void EnergyGuard::begin(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                        const Material& material, const StepInput& input, const Parallel& parallel) {
    const std::size_t n = phyxels.size();
    for (auto* array : {&position_, &velocity_}) array->resize(n);
    rotation_.resize(n);
    if (material.plasticity) plastic_strain_ = phyxels.plastic_strain;
    touching_ = phyxels.touching;
    start_.assign(static_cast<std::size_t>(std::max(input.piece_count, 0)), Account{});
    extra_.assign(start_.size(), 0);
    pushed_.assign(start_.size(), 0);
    sum_up(phyxels, input, false, start_, parallel, [&](std::size_t i) {
        position_[i] = phyxels.position[i];
        velocity_[i] = phyxels.velocity[i];
        rotation_[i] = phyxels.rotation[i];
    });
    if (phyxels.history_step > 0) return;
    // Before the first step: however it was placed is what it has.
    rows_.resize(phyxels.size());
    elastic_.take_state(neighbourhoods, material, configuration_of(phyxels), parallel);
    elastic_.energy(configuration_of(phyxels), parallel, rows_);
    const std::vector<double>& elastic = elastic_by_piece(phyxels, rows_);
    for (std::size_t k = 0; k < start_.size(); ++k) start_[k].elastic = elastic[k];
}

void EnergyGuard::add_work(std::int32_t piece, double work) {
    if (piece >= 0 && static_cast<std::size_t>(piece) < extra_.size())
        extra_[static_cast<std::size_t>(piece)] += work;
}

void EnergyGuard::count_contacts(const Phyxels& phyxels, const ContactInput& contacts, std::uint32_t part,
                                 bool of_whole_step) {
    std::fill(pushed_.begin(), pushed_.end(), 0.0);
    const auto add = [&](const ContactSide& side, const Vec3& force) {
        if (side.part != part || side.count == 0 || !is_counted(phyxels, side.phyxel[0])) return;
        Vec3 way = Vec3::Zero();
        for (std::uint32_t k = 0; k < side.count; ++k)
            way += side.weight[k] * (phyxels.position[side.phyxel[k]] - position_[side.phyxel[k]]);
        const double work = force.dot(way);
        pushed_[slot(phyxels, side.phyxel[0])] += work + work_slack * std::abs(work);
    };
    CachedContactFinder finder(contacts.cached);
    for (const Contact& contact : contacts.contacts) {
        const CachedContact* const pushed = finder.find(contact.key);
        if (pushed == nullptr) continue;
        add(contact.upper, pushed->force);
        add(contact.lower, -pushed->force);
    }
    // What stops a piece in the last substep took less than that force along the whole way.
    if (!of_whole_step)
        for (double& work : pushed_) work = std::max(0.0, work);
    for (const HandleSpring& pull : contacts.handle_springs)
        if (pull.part == part && is_counted(phyxels, pull.phyxel))
            pushed_[slot(phyxels, pull.phyxel)] = std::numeric_limits<double>::infinity();
}

std::vector<double>& EnergyGuard::elastic_by_piece(const Phyxels& phyxels, std::span<const double> rows) {
    sum_.assign(start_.size(), 0);
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (is_counted(phyxels, i)) sum_[slot(phyxels, i)] += rows[i];
    return sum_;
}

// What a hold that only shifts what it holds does: all that changes the momentum of what is not
// held, and is not gravity, is its. Exact, whatever the forces are.
double EnergyGuard::work_along(const Material& material, const StepInput& input, std::size_t k) const {
    const Account& start = start_[k];
    const double mass = start.mass - start.held_mass;
    const Vec3 damping = 0.5 * material.mass_damping * (start.linear + end_[k].linear);
    const Vec3 force = (end_[k].linear - start.linear) / input.dt + damping - mass * input.gravity;
    return force.dot(start.held_way);
}

// The larger of what the forces before the step and those after it would have cost: an
// implicit step's force is that of its end, and that of an unfinished one lies between.
void EnergyGuard::add_hold_work(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                const Material& material, const StepInput& input, const Parallel& parallel) {
    force_.resize(phyxels.size());
    const auto work_at = [&](const SlicedElasticity::Configuration& place, std::vector<double>& work) {
        elastic_.take_state(neighbourhoods, material, place, parallel);
        elastic_.forces(force_, parallel);
        work.assign(start_.size(), 0);
        for (std::size_t i = 0; i < phyxels.size(); ++i)
            if (is_counted(phyxels, i) && is_held(input, i))
                work[slot(phyxels, i)] -= force_[i].dot(input.held_position[i] - position_[i]);
    };
    work_at({phyxels.rest_position, position_, rotation_,
             material.plasticity ? std::span<const Mat3>(plastic_strain_) : std::span<const Mat3>()},
            hold_work_);
    work_at(configuration_of(phyxels), most_);
    for (std::size_t k = 0; k < hold_work_.size(); ++k) hold_work_[k] = std::max(hold_work_[k], most_[k]);
}

// Whether a piece's momentum is another than gravity and mass damping leave it.
bool EnergyGuard::was_pushed(const Material& material, const StepInput& input, std::size_t k) const {
    const Account& start = start_[k];
    if (start.held_mass > 0 || start.touches || end_[k].touches) return true;
    const Vec3 pull = input.dt * start.mass * input.gravity;
    const double size = start.linear.norm() + pull.norm();
    const double lost = std::min(1.0, material.mass_damping * input.dt);
    const double rounding = 1e-9 * std::sqrt(2 * start.mass * start.all_kinetic);
    return !((end_[k].linear - start.linear - pull).norm() <= (push_share + lost) * size + rounding);
}

EnergyGuard::Verdict EnergyGuard::judge(const Material& material, const StepInput& input, double tolerance,
                                        std::size_t k) const {
    const Account& start = start_[k];
    const Account& end = end_[k];
    Verdict verdict;
    verdict.free = !was_pushed(material, input, k);
    double before = start.loose_kinetic, now = end.loose_kinetic;
    if (verdict.free) {
        before -= start.linear.squaredNorm() / (2 * start.mass);
        now -= end.linear.squaredNorm() / (2 * end.mass);
    } else {
        before += end.work;
    }
    before = verdict.free ? std::max(before, 0.0) : before;
    verdict.budget = before + start.elastic + start.reserve + extra_[k] + pushed_[k];
    const double noise = noise_strain * noise_strain * material.youngs_modulus * start.volume;
    verdict.limit = verdict.budget + motion_share * std::max(before, 0.0) +
                    tolerance * std::max(start.elastic, std::min(end.elastic, verdict.budget)) + noise;
    verdict.energy = now + end.elastic;
    verdict.over = !(verdict.energy <= verdict.limit);
    return verdict;
}

bool EnergyGuard::weigh(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                        const Material& material, const StepInput& input, double tolerance,
                        std::span<const double> hold_work, const Parallel& parallel) {
    tolerance_ = tolerance;
    verdict_.assign(start_.size(), Verdict{});
    sum_up_step(phyxels, input, true, parallel);
    any_over_ = false;
    bool holds_are_known = false;
    for (std::size_t k = 0; k < start_.size(); ++k) {
        if (!(start_[k].mass > 0)) continue;
        verdict_[k] = judge(material, input, tolerance, k);
        if (start_[k].held_moves && !hold_work.empty()) {
            end_[k].work += hold_work[k];
            verdict_[k] = judge(material, input, tolerance, k);
        } else if (start_[k].held_moves && start_[k].one_way) {
            end_[k].work += work_along(material, input, k);
            verdict_[k] = judge(material, input, tolerance, k);
        } else if (start_[k].held_moves && verdict_[k].energy > verdict_[k].budget) {
            if (!holds_are_known) add_hold_work(phyxels, neighbourhoods, material, input, parallel);
            holds_are_known = true;
            end_[k].work += hold_work_[k];
            verdict_[k] = judge(material, input, tolerance, k);
        }
        any_over_ = any_over_ || verdict_[k].over;
    }
    if (!any_over_) return false;
    find_rigid_motions(phyxels, parallel);
    return find_strained(phyxels, neighbourhoods, material, parallel);
}

// What is strained beyond what it can pay for, and beyond what it was before the step with the
// links of now: against what a cut has brought finer steps do not help.
bool EnergyGuard::find_strained(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                const Material& material, const Parallel& parallel) {
    bool any = false;
    for (std::size_t k = 0; k < start_.size(); ++k) {
        Verdict& verdict = verdict_[k];
        if (!verdict.over) continue;
        verdict.most_elastic = verdict.limit + debt_share * std::abs(verdict.budget) - rigid_energy(k);
        verdict.strained = !(end_[k].elastic <= verdict.most_elastic);
        any = any || verdict.strained;
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
        Verdict& verdict = verdict_[k];
        if (!verdict.strained) continue;
        verdict.most_elastic = std::max(verdict.most_elastic, (1 + strain_slack) * elastic[k]);
        verdict.strained = !(end_[k].elastic <= verdict.most_elastic);
        any = any || verdict.strained;
    }
    return any;
}

void EnergyGuard::find_rigid_motions(const Phyxels& phyxels, const Parallel& parallel) {
    piece_momenta(phyxels, static_cast<int>(start_.size()), after_, partial_, parallel);
}

// What a piece's momenta cannot do without, J; of one that is held nothing.
double EnergyGuard::rigid_energy(std::size_t k) const {
    if (start_[k].held_mass > 0) return 0;
    const Momenta& now = after_[k];
    const double angular_momentum =
        0.5 * now.angular_momentum.dot(angular_velocity(now.inertia, now.angular_momentum));
    return verdict_[k].free ? angular_momentum : angular_momentum + now.linear.squaredNorm() / (2 * now.mass);
}

void EnergyGuard::go_back(Phyxels& phyxels) const {
    phyxels.position = position_;
    phyxels.velocity = velocity_;
    phyxels.rotation = rotation_;
    if (plastic_strain_.size() == phyxels.size()) phyxels.plastic_strain = plastic_strain_;
    phyxels.touching = touching_;
}

void EnergyGuard::forget_parts(Phyxels& phyxels, double dt) const {
    phyxels.previous_position = position_;
    phyxels.previous_velocity = velocity_;
    phyxels.history_step = dt;
    std::fill(phyxels.history_broken.begin(), phyxels.history_broken.end(), std::uint8_t{1});
}

// Phyxels of pieces that are held back: `share` of the deformation of the step.
void EnergyGuard::place_between(Phyxels& phyxels, const StepInput& input, double share) const {
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (!is_counted(phyxels, i) || is_held(input, i) || held_back_[slot(phyxels, i)] == 0) continue;
        const std::size_t k = slot(phyxels, i);
        Vec3 stiff = position_[i];
        if (start_[k].held_mass <= 0) {
            const Vec3 rotation_rate = angular_velocity(before_[k].inertia, before_[k].angular_momentum);
            stiff = after_[k].centre + turn_by(input.dt * rotation_rate) * (position_[i] - before_[k].centre);
        } else if (start_[k].one_way) {
            stiff += start_[k].held_way;
        }
        phyxels.position[i] = share > 0 ? Vec3(stiff + share * (reached_[i] - stiff)) : stiff;
    }
}

// Takes the deformation of the step back by halves, of pieces that cannot pay for it.
void EnergyGuard::relax_excess_strain(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                      const Material& material, const StepInput& input,
                                      const Parallel& parallel) {
    held_back_.assign(start_.size(), 0);
    for (std::size_t k = 0; k < start_.size(); ++k) held_back_[k] = verdict_[k].strained;
    bool any = true;
    reached_ = phyxels.position;
    std::swap(phyxels.position, position_);
    std::swap(phyxels.velocity, velocity_);
    piece_momenta(phyxels, static_cast<int>(start_.size()), before_, partial_, parallel);
    std::swap(phyxels.position, position_);
    std::swap(phyxels.velocity, velocity_);
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (is_counted(phyxels, i) && held_back_[slot(phyxels, i)] != 0 && material.plasticity)
            phyxels.plastic_strain[i] = plastic_strain_[i];
    double share = 1;
    for (int k = 0; k <= halvings && any; ++k) {
        share = k < halvings ? 0.5 * share : 0;
        place_between(phyxels, input, share);
        elastic_.take_state(neighbourhoods, material, configuration_of(phyxels), parallel);
        elastic_.energy(configuration_of(phyxels), parallel, phyxels.elastic_energy);
        const std::vector<double>& elastic = elastic_by_piece(phyxels, phyxels.elastic_energy);
        any = false;
        for (std::size_t p = 0; p < start_.size(); ++p) {
            if (held_back_[p] == 0) continue;
            end_[p].elastic = elastic[p];
            if (elastic[p] <= verdict_[p].most_elastic) held_back_[p] = 0;
            any = any || held_back_[p] != 0;
        }
    }
    elastic_.read_deformation(phyxels.deformation, phyxels.rotation, parallel);
}

// Motion other than rigid of pieces that are over: as much as they can pay for.
void EnergyGuard::scale_velocities(Phyxels& phyxels, const StepInput& input) {
    most_.assign(start_.size(), 1);
    for (std::size_t k = 0; k < start_.size(); ++k) {
        Verdict& verdict = verdict_[k];
        if (!verdict.over) continue;
        const double rigid = rigid_energy(k);
        const double inner = verdict.energy - end_[k].elastic - rigid;
        const double room = verdict.limit - end_[k].elastic - rigid;
        most_[k] = inner > 0 && room > 0 ? std::sqrt(std::min(room / inner, 1.0)) : 0;
        if (verdict.strained) most_[k] = 0;
    }
    before_.assign(start_.size(), Momenta{});  // rigid velocities: linear m/s, spin rad/s
    for (std::size_t k = 0; k < start_.size(); ++k) {
        if (!verdict_[k].over) continue;
        if (start_[k].held_mass > 0) {
            // What was held back goes along with what holds it.
            if (verdict_[k].strained && start_[k].one_way) before_[k].linear = start_[k].held_way / input.dt;
            continue;
        }
        before_[k].linear = after_[k].linear / after_[k].mass;
        before_[k].angular_momentum = angular_velocity(after_[k].inertia, after_[k].angular_momentum);
    }
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (!is_counted(phyxels, i) || is_held(input, i)) continue;
        const std::size_t k = slot(phyxels, i);
        if (!verdict_[k].over) continue;
        const Vec3 stiff =
            before_[k].linear + before_[k].angular_momentum.cross(phyxels.position[i] - after_[k].centre);
        const Vec3 inner = phyxels.velocity[i] - stiff;
        phyxels.velocity[i] = most_[k] > 0 ? Vec3(stiff + most_[k] * inner) : stiff;
        phyxels.history_broken[i] = 1;
    }
}

void EnergyGuard::settle(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                         const StepInput& input, SolverReport& report, const Parallel& parallel) {
    if (any_over_) {
        const double before = report.kinetic_energy + report.elastic_energy;
        bool strained = false;
        for (const Verdict& verdict : verdict_) {
            report.has_energy_excess += verdict.over;
            strained = strained || verdict.strained;
        }
        if (strained) {
            relax_excess_strain(phyxels, neighbourhoods, material, input, parallel);
            // Momenta stay, and are those about the new places' centres.
            const std::vector<Momenta> kept = after_;
            find_rigid_motions(phyxels, parallel);
            for (std::size_t k = 0; k < kept.size(); ++k) {
                after_[k].linear = kept[k].linear;
                after_[k].angular_momentum = kept[k].angular_momentum;
            }
        }
        scale_velocities(phyxels, input);
        elastic_.take_state(neighbourhoods, material, configuration_of(phyxels), parallel);
        report.inverted = report.rank_deficient = 0;
        report.kinetic_energy = 0;
        describe_(phyxels, neighbourhoods, elastic_, report, parallel);
        const double taken = before - report.kinetic_energy - report.elastic_energy;
        report.energy_taken += std::isfinite(taken) ? std::max(taken, 0.0) : 0;
        sum_up_step(phyxels, input, false, parallel);
    }
    write_reserves(phyxels, parallel);
}

// What is unspent, shared out by mass so that it goes along when pieces part; what is owed,
// by elastic energy: it lies where a cut has brought some.
void EnergyGuard::write_reserves(Phyxels& phyxels, const Parallel& parallel) {
    sum_.assign(start_.size(), 0);
    for (std::size_t k = 0; k < start_.size(); ++k) {
        if (!(start_[k].mass > 0) || !std::isfinite(verdict_[k].budget)) continue;
        double now = end_[k].loose_kinetic + end_[k].elastic;
        if (verdict_[k].free) now -= end_[k].linear.squaredNorm() / (2 * end_[k].mass);
        const double left = verdict_[k].budget - now;
        const bool owes = left < 0 && end_[k].elastic > 0;
        sum_[k] = owes ? left / end_[k].elastic : (left > 0 ? reserve_kept * left : left) / start_[k].mass;
    }
    for_phyxels(parallel, phyxels.size(), [&](std::size_t i) {
        phyxels.reserve[i] = 0;
        if (!is_counted(phyxels, i)) return;
        const std::size_t k = slot(phyxels, i);
        const bool owes = sum_[k] < 0 && end_[k].elastic > 0;
        const double share = sum_[k] * (owes ? phyxels.elastic_energy[i] : phyxels.mass[i]);
        if (std::isfinite(share)) phyxels.reserve[i] = share;
    });
}

}  // namespace splitcubes::meshless
