// The linear solve of ImplicitSolver's step, over all bodies that step together: preconditioned
// conjugate gradients (Hestenes and Stiefel 1952).
#include <splitcubes/meshless/solver_group.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::meshless {

namespace {

// Share of the wanted square of the residual that rounding may make up.
constexpr double noise_share = 0.1;
// What stands on something rocks by the least force that is left over: share of the tolerance that is solved
// to.
constexpr double contact_tolerance_share = 0.01;
// Of the largest residual that a solve began from, the share that is enough (where a guess leaves much, as
// while something is cut, nothing rocks by little), and by how many times that may be more than the tolerance
// asks for where nothing touches.
constexpr double fall_share = 1e-2, most_loose = 10;
// While contacts still change, the share of what a solve begins with that it may leave: of the first of a
// step, which only has to tell what pushes, and of those that follow.
constexpr double first_early_share = 0.2, early_share = 0.1;
// Aggregates are weighed anew where the springs' stiffness has changed by more than this share.
constexpr double weighed_share = 0.1;
// Share that the square of a residual falls by before it is taken again in double precision.
constexpr double reach_share = 1e-11;

}  // namespace

double ImplicitSolver::Group::tolerance() const {
    const double share = forces->empty() ? 1 : contact_tolerance_share;
    return tolerance_factor * share * jobs[0].options.tolerance;
}

// Square of the residual that is enough after the one that was begun from; closest: by the tolerance. Of
// what touches something no more than the plain tolerance's.
double ImplicitSolver::Group::loosest(double closest) const {
    const double times = forces->empty() ? most_loose : 1 / (tolerance_factor * contact_tolerance_share);
    return std::min(times * times * closest, fall_share * fall_share * furthest);
}

double ImplicitSolver::Group::wanted_residual() {
    double wanted = 0;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        wanted += s.wanted_residual(job, tolerance());
    });
    return wanted;
}

// r_ = b - A d_ of all bodies; returns its square in the norm of the inverse diagonal. noise: what rounding
// may make of that. `exact`: in double precision.
double ImplicitSolver::Group::residual(bool exact, double& noise) {
    bool at_base = true;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) { at_base = at_base && s.is_at_base(job); });
    double square = 0;
    noise = 0;
    if (at_base) {
        each([&](ImplicitSolver& s, const Job& job, std::uint32_t) { square += s.residual_at_base(job); });
        return square;
    }
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) { s.stiffness_times_solution(job, exact); });
    if (!forces->empty()) forces->apply(solution, image);
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        double part = 0;
        square += s.residual_from_product(job, exact, part);
        noise += part;
    });
    return square;
}

// From the solution; in double precision where single would say nothing.
double ImplicitSolver::Group::first_residual(double wanted) {
    double noise = 0;
    double square = residual(false, noise);
    if (noise > noise_share * wanted) square = residual(true, noise);
    furthest = square;
    return square;
}

// Of r_ as it was left by the last solve.
double ImplicitSolver::Group::carried_residual() {
    double square = 0;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) { square += s.square_of(job, s.r_); });
    furthest = std::max(furthest, square);
    return square;
}

// The preconditioner's coarse part: as good with springs that are a little different.
void ImplicitSolver::Group::weigh() {
    if (std::abs(springs - weighed) <= weighed_share * weighed) return;
    weighed = springs;
    each([](ImplicitSolver& s, const Job& job, std::uint32_t) { s.weigh_aggregates(job); });
}

// From d_; constrained parts of d_ stay. Not `anew`: r_ is the residual.
void ImplicitSolver::Group::solve(bool anew) {
    const double closest = wanted_residual();
    each([](ImplicitSolver& s, const Job&, std::uint32_t) { ++s.report_.solves; });
    int left = jobs[0].options.max_iterations;
    double square = anew ? first_residual(closest) : carried_residual();
    const double early = tolerance_factor > 1 ? (anew ? first_early_share : early_share) : 0;
    const double wanted = std::max({closest, loosest(closest), early * early * square});
    if (!anew && wanted < reach_share * furthest) square = first_residual(wanted);
    if (anew) weighed = -1;
    if (square > wanted) weigh();
    for (int pass = 0; pass < max_refinements && square > wanted && left > 0; ++pass) {
        // Single precision carries no further than this at a time.
        const bool in_reach = wanted >= reach_share * square;
        const double before = square;
        square = descend(in_reach ? wanted : reach_share * square, left);
        if (in_reach) break;
        double noise = 0;
        square = furthest = residual(true, noise);
        if (!(square < 0.25 * before)) break;
    }
    double reached = square > 0 && closest > 0 ? tolerance() * std::sqrt(square / closest) : 0;
    // A solve that ended where it was to is no more than the tolerance off.
    if (square <= wanted) reached = std::min(reached, jobs[0].options.tolerance);
    each([&](ImplicitSolver& s, const Job&, std::uint32_t) { s.report_.residual = reached; });
}

// Square of the residual in the norm of the inverse diagonal.
double ImplicitSolver::Group::begin_direction() {
    double square = 0;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        s.take_residual(job);
        square += s.sum_slices(job, [&](const SliceRange& range) {
            return meshless::begin_direction(s.elastic_.stride(), range, s.fine_inverse_.data(),
                                             s.fine_r_.data(), s.fine_p_.data());
        });
    });
    return square;
}

// Image of the direction; returns their product.
double ImplicitSolver::Group::apply_to_direction() {
    double product = 0;
    rows.clear();
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        const auto factor = static_cast<float>(1 + s.damping_ratio(job));
        product += s.elastic_.apply_stiffness(factor, s.fine_diagonal_.data(), s.fine_p_.data(),
                                              s.fine_q_.data(), job.parallel);
        rows.push_back({s.elastic_.stride(), s.fine_p_.data(), s.fine_q_.data()});
    });
    if (!forces->empty()) product += forces->products().apply(rows, jobs[0].parallel);
    each([](ImplicitSolver& s, const Job&, std::uint32_t) { s.filter(); });
    return product;
}

// The list of springs that the products of a descent go through, and the diagonals beside them.
void ImplicitSolver::Group::list_springs() {
    if (forces->empty()) return;
    if (!forces->list_springs() && diagonals_taken) return;
    diagonals_taken = true;
    diagonals.clear();
    each([&](ImplicitSolver& s, const Job&, std::uint32_t) {
        diagonals.push_back({s.mobility_, s.inverse_, s.held_});
    });
    forces->products().set_diagonals(diagonals);
}

// What springs add to the preconditioner goes from residual to direction.
void ImplicitSolver::Group::take_smoothing_rows() {
    rows.clear();
    each([&](ImplicitSolver& s, const Job&, std::uint32_t) {
        rows.push_back({s.elastic_.stride(), s.fine_r_.data(), s.fine_p_.data()});
    });
}

// The springs' part of the residual's square in the preconditioner's norm.
double ImplicitSolver::Group::smooth() {
    if (forces->empty()) return 0;
    take_smoothing_rows();
    return forces->products().smooth(rows, jobs[0].parallel);
}

// As begin_direction, after a step of alpha.
double ImplicitSolver::Group::advance(float alpha) {
    double square = 0;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        square += s.sum_slices(job, [&](const SliceRange& range) {
            return meshless::advance(s.elastic_.stride(), range, alpha, s.fine_inverse_.data(),
                                     s.fine_p_.data(), s.fine_q_.data(), s.fine_d_.data(), s.fine_r_.data());
        });
    });
    return square;
}

// The aggregates' part of the residual's square in the preconditioner's norm.
double ImplicitSolver::Group::correct() {
    double square = 0;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        square += s.aggregates_.correct(s.fine_r_.data(), job.parallel);
    });
    return square;
}

void ImplicitSolver::Group::turn_direction(float beta) {
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        const CoarsePart coarse{s.aggregates_.index(), s.aggregates_.correction(), s.aggregates_.count() + 1};
        for_slices(job.parallel, s.elastic_.slice_count(), [&](const SliceRange& range) {
            meshless::turn_direction(s.elastic_.stride(), range, beta, s.fine_inverse_.data(),
                                     s.fine_r_.data(), coarse, s.fine_p_.data());
        });
    });
    if (forces->empty()) return;
    take_smoothing_rows();
    forces->products().add_smoothed(rows);
}

// Adds to d_ what brings the square of the residual r_ down to `goal`; returns where it got.
double ImplicitSolver::Group::descend(double goal, int& left) {
    list_springs();
    double square = begin_direction();
    double rz = square + correct() + smooth();
    turn_direction(0);
    while (square > goal && left > 0) {
        const double curvature = apply_to_direction();
        if (!(curvature > 0) || !std::isfinite(curvature)) break;
        const double next = advance(static_cast<float>(rz / curvature));
        if (!std::isfinite(next)) break;
        square = next;
        ++solvers[0]->report_.iterations;
        --left;
        if (square <= goal) break;
        const double next_rz = square + correct() + smooth();
        turn_direction(static_cast<float>(next_rz / rz));
        rz = next_rz;
    }
    each([](ImplicitSolver& s, const Job& job, std::uint32_t) { s.add_found(job); });
    return square;
}

}  // namespace splitcubes::meshless
