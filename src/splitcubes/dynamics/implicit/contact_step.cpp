// Sequence of ImplicitSolver's step, for one body or for several in contact.
#include <splitcubes/core/disjoint_sets.h>
#include <splitcubes/dynamics/implicit/solver_group.h>
#include <splitcubes/dynamics/tuning.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace splitcubes::meshless {

ImplicitSolver::GroupBuffer::GroupBuffer() = default;
ImplicitSolver::GroupBuffer::GroupBuffer(const GroupBuffer& /*other*/) {}
ImplicitSolver::GroupBuffer& ImplicitSolver::GroupBuffer::operator=(const GroupBuffer& /*other*/) {
    return *this;
}
ImplicitSolver::GroupBuffer::~GroupBuffer() = default;

ImplicitSolver::Group& ImplicitSolver::GroupBuffer::get() {
    if (!group_) group_ = std::make_unique<Group>();
    return *group_;
}

// Breaks the history of pieces with a contact that became active or inactive: extrapolated past such a
// change, BDF2 creates energy when a body rolls from contact to contact.
void ImplicitSolver::Group::break_switched_histories(const ContactInput& contacts) {
    for (std::size_t c = 0; contacts.cached && c < pushed_before.size(); ++c) {
        if (forces->pushes(c) == (pushed_before[c] != 0)) continue;
        const Contact& contact = contacts.contacts[c];
        for (const ContactSide* side : {&contact.upper, &contact.lower})
            for (std::uint32_t k = 0; k < side->count; ++k) {
                ImplicitSolver& s = *solvers[side->part];
                s.conditions_.hit[s.piece_of(jobs[side->part], side->phyxel[k])] = 1;
            }
    }
}

// Carries out the rotations of pieces in the solution as finite ones. Returns whether the solution stretched
// pieces so much that the system must be linearised again. Without contacts, a prediction that has turned
// finitely leaves too little rotation for that.
bool ImplicitSolver::Group::turn_solutions() {
    if (forces->empty()) return false;
    double stretch = 0, motion = 0;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        s.kept_.d = s.vectors_.d;
        s.rotations_.apply(job.phyxels, job.material, job.input.piece_count, s.conditions_.held,
                           s.system_.base, s.kept_.d, job.parallel);
        stretch += s.rotations_.stretch_energy();
        motion += s.energy_of_motion(job);
    });
    if (!(stretch > tuning::passes::stretch_share * motion)) return false;
    each([](ImplicitSolver& s, const Job&, std::uint32_t) {
        s.vectors_.d.swap(s.kept_.d);
        s.conditions_.is_turned = true;
    });
    return true;
}

// Returns the kinetic energy before the step plus what gravity alone could add, J.
double ImplicitSolver::energy_of_motion(const Job& job) {
    const double falling = job.input.dt * job.input.gravity.norm();
    return sum_(job.parallel, job.phyxels.size(), [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const double speed = prediction_.start_velocity[i].norm() + falling;
            sum += 0.5 * job.phyxels.mass[i] * speed * speed;
        }
        return sum;
    });
}

// Linearises at the solution and solves from there.
void ImplicitSolver::Group::relinearise() {
    each([](ImplicitSolver& s, const Job& job, std::uint32_t) {
        for_phyxels(job.parallel, s.vectors_.d.size(), [&](std::size_t i) {
            s.system_.base[i] += s.vectors_.d[i];
            s.vectors_.d[i].setZero();
        });
        s.linearise(job);
    });
    slow.clear_matrices();
    solve_with_contacts();
}

SolverReport ImplicitSolver::step(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                  const Material& material, const StepInput& input,
                                  const SolverOptions& options, const Parallel& parallel) {
    std::array<Member, 1> alone = {Member{*this, phyxels, neighbourhoods, material, input}};
    step_together(alone, input.contacts, options, parallel);
    return alone[0].report;
}

void ImplicitSolver::step_together(std::span<Member> members, const ContactInput& contacts,
                                   const SolverOptions& options, const Parallel& parallel) {
    Group& group = members[0].solver.group_.get();
    group.clear();
    group.forces = &members[0].solver.contacts_;
    for (Member& m : members) {
        check_step_input(m.phyxels, m.input);
        assert(m.neighbourhoods.size() == m.phyxels.size());
        const Job job{m.phyxels, m.neighbourhoods, m.material, m.input, options, parallel};
        m.solver.report_ = SolverReport{};
        m.solver.size_buffers(m.phyxels.size());
        group.add(m.solver, job);
    }
    find_impacts(contacts, group.velocity, members[0].input.dt, parallel, group.pushed_before, group.impact);
    group.each([&](ImplicitSolver& s, const Job& job, std::uint32_t k) {
        s.mark_hits(job, contacts, group.impact, k);
        s.mark_restrained(job, contacts, k);
        s.prepare(job);
    });
    group.recall_slow_steps();
    group.begin_contacts(contacts);
    group.solve_with_contacts();
    const auto any_new_distortion = [&] {
        bool any = false;
        group.each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
            any = s.has_new_distortion(job) || any;
        });
        return any;
    };
    // The last rotation is carried out, too: its stretch would be elastic energy.
    for (int pass = 0; group.turn_solutions() && pass < tuning::passes::max_turns; ++pass)
        group.relinearise();
    int further_solves = options.further_solves;
    group.each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        if (s.is_jerked(job)) further_solves = std::max(further_solves, tuning::passes::solves_after_jerks);
    });
    for (int pass = 0;
         pass < tuning::passes::max_relinearisations && (pass < further_solves || any_new_distortion());
         ++pass)
        group.relinearise();
    group.each([](ImplicitSolver& s, const Job& job, std::uint32_t) {
        s.place_at_solution(job);
        std::fill(job.phyxels.touching.begin(), job.phyxels.touching.end(), std::uint8_t{0});
    });
    group.count_slow_steps();
    group.forces->finish(group.position, group.touching, parallel);
    group.break_switched_histories(contacts);
    group.each([&](ImplicitSolver& s, const Job& job, std::uint32_t k) {
        s.mark_force_jumps(job, *group.forces, contacts, k);
        s.update_phyxels(job);
        s.bind_pieces(job, contacts, k);
    });
    if (options.restore_momentum && members.size() > 1) restore_shared(group, contacts);
    group.each([&](ImplicitSolver& s, const Job& job, std::uint32_t k) {
        s.finish(job);
        members[k].report = s.report_;
    });
    members[0].report.contacts = group.forces->pushing();
    members[0].report.contact_energy = group.forces->energy();
    members[0].report.work.handles = group.forces->handle_work();
}

// Marks the pieces that are hit in this step.
void ImplicitSolver::mark_hits(const Job& job, const ContactInput& contacts,
                               std::span<const std::uint8_t> impact, std::uint32_t part) {
    conditions_.hit.assign(static_cast<std::size_t>(job.input.piece_count) + 1, 0);
    for (std::size_t c = 0; c < impact.size(); ++c) {
        if (impact[c] == 0) continue;
        for (const ContactSide* side : {&contacts.contacts[c].upper, &contacts.contacts[c].lower})
            for (std::uint32_t k = 0; k < side->count; ++k)
                if (side->part == part) conditions_.hit[piece_of(job, side->phyxel[k])] = 1;
    }
}

// Marks pieces whose contact force changed strongly since the previous step as hit: their history must not be
// extrapolated either.
void ImplicitSolver::mark_force_jumps(const Job& job, const ContactForces& forces,
                                      const ContactInput& contacts, std::uint32_t part) {
    if (contacts.contacts.empty()) return;
    force_jumps_.change.assign(conditions_.hit.size() - 1, Vec3::Zero());
    forces.add_changes(part, job.phyxels.piece, force_jumps_.change);
    force_jumps_.piece_mass.assign(force_jumps_.change.size(), 0);
    for (std::size_t i = 0; i < job.phyxels.size(); ++i)
        if (piece_of(job, i) < force_jumps_.piece_mass.size())
            force_jumps_.piece_mass[piece_of(job, i)] += job.phyxels.mass[i];
    const double max_depenetration = forces.min_depenetration();
    for (std::size_t k = 0; k < force_jumps_.change.size(); ++k)
        if (force_jumps_.change[k].norm() * job.input.dt * job.input.dt >
            tuning::passes::force_jump * max_depenetration * force_jumps_.piece_mass[k])
            conditions_.hit[k] = 1;
}

// Marks the pieces that can be under lasting tension.
void ImplicitSolver::mark_restrained(const Job& job, const ContactInput& contacts, std::uint32_t part) {
    conditions_.restrained.assign(static_cast<std::size_t>(job.input.piece_count) + 1, 0);
    for (std::size_t i = 0; i < job.input.held.size(); ++i)
        if (job.input.held[i] != 0) conditions_.restrained[piece_of(job, i)] = 1;
    for (const HandleSpring& handle_spring : contacts.handle_springs)
        if (handle_spring.part == part) conditions_.restrained[piece_of(job, handle_spring.phyxel)] = 1;
}

void ImplicitSolver::prepare(const Job& job) {
    find_step_conditions(job);
    momenta_.begin(job.phyxels, job.input.piece_count, job.parallel);
    mark_far_turns(job);
    predict(job);
    start_guess(job);
    linearise(job);
}

// Writes the positions of the solution to p.
void ImplicitSolver::place_at_solution(const Job& job) {
    for_phyxels(job.parallel, job.phyxels.size(),
                [&](std::size_t i) { vectors_.p[i] = system_.base[i] + vectors_.d[i]; });
}

void ImplicitSolver::update_phyxels(const Job& job) {
    for_phyxels(job.parallel, job.phyxels.size(), [&](std::size_t i) { finish_phyxel(job, i); });
    for (std::size_t i = 0; i < job.phyxels.size(); ++i) report_.non_finite += conditions_.failed[i];
    if (conditions_.is_turned) straighten_velocities(job);
}

// Excludes pieces that are held or pulled from the restoring of momenta, and joins pieces that touch each
// other.
void ImplicitSolver::bind_pieces(const Job& job, const ContactInput& contacts, std::uint32_t part) {
    const Phyxels& phyxels = job.phyxels;
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (conditions_.held[i] != 0 || conditions_.failed[i] != 0) momenta_.bind(phyxels.piece[i]);
    for (const HandleSpring& handle_spring : contacts.handle_springs)
        if (handle_spring.part == part) momenta_.bind(phyxels.piece[handle_spring.phyxel]);
    momenta_.join_touching(phyxels, contacts, part);
}

// Restores the joint momenta of pieces of several bodies that touch nothing but each other, as is done within
// one body.
void ImplicitSolver::restore_shared(Group& group, const ContactInput& contacts) {
    const std::vector<std::uint32_t> first = group.first_slots();
    DisjointSets sets(first.back());
    std::vector<std::uint8_t> bound(first.back(), 0), shared(first.back(), 0);
    const auto slot_of = [&](std::uint32_t part, std::uint32_t phyxel) {
        return group.piece_slot(first, part, phyxel);
    };
    CachedContactFinder finder(contacts.cached);
    for (const Contact& c : contacts.contacts) {
        if (!finder.find(c.key)) continue;
        const std::uint32_t upper = slot_of(c.upper.part, c.upper.phyxel[0]);
        if (c.lower.is_collider()) {
            bound[upper] = 1;
            continue;
        }
        if (c.lower.part != c.upper.part) shared[upper] = 1;
        sets.join(upper, slot_of(c.lower.part, c.lower.phyxel[0]));
    }
    for (const HandleSpring& handle_spring : contacts.handle_springs)
        bound[slot_of(handle_spring.part, handle_spring.phyxel)] = 1;
    group.each([&](ImplicitSolver& s, const Job&, std::uint32_t k) {
        bound[first[k + 1] - 1] = 1;
        for (std::uint32_t i = 0; i < s.conditions_.held.size(); ++i)
            if (s.conditions_.held[i] != 0 || s.conditions_.failed[i] != 0) bound[slot_of(k, i)] = 1;
    });
    std::vector<std::uint8_t> any_bound(bound.size(), 0), any_shared(bound.size(), 0);
    for (std::uint32_t slot = 0; slot < bound.size(); ++slot) {
        any_bound[sets.find(slot)] |= bound[slot];
        any_shared[sets.find(slot)] |= shared[slot];
    }
    for (std::uint32_t slot = 0; slot < bound.size(); ++slot)
        if (sets.find(slot) == slot && any_shared[slot] != 0 && any_bound[slot] == 0)
            group.restore(slot,
                          [&](std::uint32_t part, std::uint32_t i) { return sets.find(slot_of(part, i)); });
}

// Gives the phyxels of one set of touching pieces, by a rigid velocity, the momenta that they had together,
// after gravity and mass damping: first by moving positions as well, then by velocities to rounding.
void ImplicitSolver::Group::restore(std::size_t set, const SetOf& set_of) {
    const auto sum_up = [&](bool before) {
        Momenta sum;
        const auto every = [&](const auto& act) {
            each([&](ImplicitSolver& s, const Job& job, std::uint32_t k) {
                const double dt = job.input.dt;
                const double damping_factor = before ? 1 / (1 + dt * job.material.mass_damping) : 1;
                for (std::uint32_t i = 0; i < job.phyxels.size(); ++i) {
                    if (set_of(k, i) != set) continue;
                    const Vec3& x = before ? s.prediction_.start_position[i] : job.phyxels.position[i];
                    const Vec3 v = before ? Vec3(damping_factor *
                                                 (s.prediction_.start_velocity[i] + dt * job.input.gravity))
                                          : job.phyxels.velocity[i];
                    act(job.phyxels.mass[i], x, v);
                }
            });
        };
        every([&](double m, const Vec3& x, const Vec3& v) {
            sum.mass += m;
            sum.centre += m * x;
            sum.linear += m * v;
        });
        if (!(sum.mass > 0)) return sum;
        sum.centre /= sum.mass;
        const Vec3 mean = sum.linear / sum.mass;
        every([&](double m, const Vec3& x, const Vec3& v) {
            const Vec3 arm = x - sum.centre;
            sum.angular_momentum += m * arm.cross(v - mean);
            sum.inertia += m * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
        });
        return sum;
    };
    const Momenta target = sum_up(true);
    if (!(target.mass > 0)) return;
    for (const bool moving : {true, false}) {
        const Momenta current = sum_up(false);
        const Vec3 shift = (target.linear - current.linear) / current.mass;
        const Vec3 rotation_rate =
            angular_velocity(current.inertia, target.angular_momentum - current.angular_momentum);
        each([&](ImplicitSolver& s, const Job& job, std::uint32_t k) {
            for (std::uint32_t i = 0; i < job.phyxels.size(); ++i) {
                if (set_of(k, i) != set) continue;
                const Vec3 change = shift + rotation_rate.cross(job.phyxels.position[i] - current.centre);
                job.phyxels.velocity[i] += change;
                if (moving) job.phyxels.position[i] += s.system_.b[i] * change;
            }
        });
    }
}

// Restores the momenta and reports the state after the step.
void ImplicitSolver::finish(const Job& job) {
    Phyxels& phyxels = job.phyxels;
    const double dt = job.input.dt;
    if (job.options.restore_momentum)
        momenta_.restore(phyxels, 1 / (1 + dt * job.material.mass_damping), dt * job.input.gravity, system_.b,
                         dt, job.parallel);
    phyxels.history_step = dt;
    const bool has_state = relinearisation_.has_solution_state && vectors_.p == phyxels.position;
    deform_and_flow(phyxels, job.neighbourhoods, job.material, dt, elastic_, job.parallel, has_state);
    describe_(phyxels, job.neighbourhoods, elastic_, report_, job.parallel);
}

}  // namespace splitcubes::meshless
