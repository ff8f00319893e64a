// Contacts within ImplicitSolver's step: solves and revisions of the springs in turn.
#include <splitcubes/dynamics/implicit/solver_group.h>
#include <splitcubes/dynamics/tuning.h>

#include <cmath>
#include <limits>

namespace splitcubes::meshless {

// Returns the weight of the pieces of these phyxels, N.
double ImplicitSolver::weight_of_pieces(const Job& job, std::span<const std::uint32_t> of) {
    if (of.empty()) return 0;
    conditions_.near.assign(conditions_.hit.size(), 0);
    for (const std::uint32_t i : of) conditions_.near[piece_of(job, i)] = 1;
    double mass = 0;
    for (std::size_t i = 0; i < job.phyxels.size(); ++i)
        if (conditions_.near[piece_of(job, i)] != 0) mass += job.phyxels.mass[i];
    return mass * job.input.gravity.norm();
}

// Sums the masses of pieces; those of which a part is held count as infinitely heavy.
void ImplicitSolver::sum_piece_masses(const Job& job) {
    conditions_.piece_mass.assign(conditions_.hit.size(), 0);
    for (std::size_t i = 0; i < job.phyxels.size(); ++i)
        conditions_.piece_mass[piece_of(job, i)] +=
            conditions_.held[i] != 0 ? std::numeric_limits<double>::infinity() : job.phyxels.mass[i];
}

// Creates the springs at the positions of the initial guess.
void ImplicitSolver::Group::begin_contacts(const ContactInput& input) {
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        s.sum_piece_masses(job);
        parts.push_back({s.prediction_.start_position, s.prediction_.start_velocity, job.input.dt,
                         s.system_.mobility, s.conditions_.held, job.phyxels.piece,
                         s.conditions_.piece_mass});
    });
    forces->begin(input, parts);
    position_touched();
    double weight = 0;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t k) {
        weight += s.weight_of_pieces(job, forces->touched(k));
    });
    forces->make_springs(position, weight, jobs[0].parallel);
}

// Writes the current solution positions of the phyxels that springs act on.
void ImplicitSolver::Group::position_touched() {
    each([&](ImplicitSolver& s, const Job&, std::uint32_t k) {
        for (const std::uint32_t i : forces->touched(k))
            s.vectors_.p[i] = s.system_.base[i] + s.vectors_.d[i];
    });
}

// Clears the contributions of springs.
void ImplicitSolver::Group::clear_contacts() {
    each([](ImplicitSolver& s, const Job& job, std::uint32_t) {
        s.springs_.stiffness.resize(s.system_.inverse.size());
        for_phyxels(job.parallel, s.system_.inverse.size(), [&](std::size_t i) {
            s.system_.inverse[i] = s.system_.mobility[i];
            s.springs_.force[i].setZero();
            s.springs_.stiffness[i] = 0;
        });
    });
    spring_stiffness = 0;
    are_diagonals_set = false;
}

// Updates what depends on the springs: their forces at the base, and the diagonal of the preconditioner.
void ImplicitSolver::Group::refresh_contacts() {
    if (forces->empty()) return;
    spring_stiffness = 0;
    each([&](ImplicitSolver& s, const Job&, std::uint32_t k) {
        const std::span<const std::uint32_t> touched = forces->touched(k);
        for (const std::uint32_t i : touched) {
            s.springs_.force[i].setZero();
            s.springs_.stiffness[i] = 0;
        }
        forces->add_diagonal(k, s.springs_.stiffness);
        for (const std::uint32_t i : touched) {
            s.system_.inverse[i] =
                s.system_.mobility[i] / (1 + s.springs_.stiffness[i] * s.system_.mobility[i]);
            spring_stiffness += s.springs_.stiffness[i];
        }
    });
    forces->add_forces(base, spring_force, jobs[0].parallel);
}

// Revises the springs where their forces violate the contact law, and updates the residual accordingly.
// Returns whether anything changed.
bool ImplicitSolver::Group::revise() {
    if (forces->empty()) return false;
    position_touched();
    each([&](ImplicitSolver& s, const Job&, std::uint32_t k) {
        for (const std::uint32_t i : forces->touched(k)) s.vectors_.q[i].setZero();
    });
    if (!forces->revise(position, matrix_product, jobs[0].parallel)) return false;
    each([&](ImplicitSolver& s, const Job&, std::uint32_t k) {
        for (const std::uint32_t i : forces->touched(k)) s.vectors_.r[i] += s.filtered(i, s.vectors_.q[i]);
    });
    refresh_contacts();
    return true;
}

// Keeps the solution and its residual for shorten.
void ImplicitSolver::Group::keep_solution() {
    each([](ImplicitSolver& s, const Job& job, std::uint32_t) {
        s.kept_.d.resize(s.vectors_.d.size());
        s.kept_.r.resize(s.vectors_.r.size());
        for_phyxels(job.parallel, s.vectors_.d.size(), [&](std::size_t i) {
            s.kept_.d[i] = s.vectors_.d[i];
            s.kept_.r[i] = s.vectors_.r[i];
        });
    });
}

// Returns the work of the residual r along the last solve, J.
double ImplicitSolver::work_along_solve(const Job& job, std::span<const Vec3> r) {
    return sum_(job.parallel, r.size(), [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += r[i].dot(vectors_.d[i] - kept_.d[i]);
        return sum;
    });
}

// Returns the share of the last solve, from the kept solution on, at which the power of all forces along it
// vanishes. The forces are linear along it, except that contacts open, close and begin to slide.
double ImplicitSolver::Group::best_share() {
    double at_start = 0, at_end = 0;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        at_start += s.work_along_solve(job, s.kept_.r);
        at_end += s.work_along_solve(job, s.vectors_.r);
    });
    if (!(at_start > 0)) return 1;
    each([&](ImplicitSolver& s, const Job&, std::uint32_t k) {
        for (const std::uint32_t i : forces->touched(k)) s.vectors_.q[i] = s.system_.base[i] + s.kept_.d[i];
    });
    position_touched();
    search_start.assign(matrix_product.begin(), matrix_product.end());
    forces->begin_search(search_start, position, jobs[0].parallel);
    const auto power = [&](double t) {
        return (1 - t) * at_start + t * at_end + forces->excess_power(t, jobs[0].parallel);
    };
    const double enough = tuning::search::enough * at_start;
    if (power(1) > -enough) return 1;
    double low = 0, high = 1, t = 1;
    for (int k = 0; k < tuning::search::bisections; ++k) {
        t = 0.5 * (low + high);
        const double at = power(t);
        if (std::abs(at) < 0.5 * enough) break;
        (at > 0 ? low : high) = t;
    }
    return t;
}

// Shortens the last solve to where the contacts as they are there allow it. Without that, sets
// of contacts that do not push together follow each other without end.
void ImplicitSolver::Group::shorten_solve() {
    const double t = best_share();
    if (t == 1) return;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        for_phyxels(job.parallel, s.vectors_.d.size(), [&](std::size_t i) {
            s.vectors_.d[i] = s.kept_.d[i] + t * (s.vectors_.d[i] - s.kept_.d[i]);
            s.vectors_.r[i] = s.kept_.r[i] + t * (s.vectors_.r[i] - s.kept_.r[i]);
        });
    });
}

// Solves with contacts: solves with a loose tolerance determine the active contacts; once nothing changes any
// more, the last solve continues to the full tolerance.
void ImplicitSolver::Group::solve_with_contacts() {
    clear_contacts();
    refresh_contacts();
    tolerance_factor = forces->empty() ? 1 : tuning::passes::early_tolerance_factor;
    solve(true);
    for (int pass = 0; pass < tuning::passes::max_passes; ++pass) {
        const bool changed = revise();
        if (!changed && tolerance_factor == 1) break;
        if (!changed || pass + tuning::passes::tight_passes >= tuning::passes::max_passes)
            tolerance_factor = 1;
        if (changed) keep_solution();
        solve(false);
        if (changed) shorten_solve();
    }
    tolerance_factor = 1;
}

}  // namespace splitcubes::meshless
