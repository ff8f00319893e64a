// Linear solve of ImplicitSolver's step over all bodies of a group: preconditioned conjugate gradients
// (Hestenes and Stiefel 1952).
#include <splitcubes/dynamics/implicit/solver_group.h>
#include <splitcubes/dynamics/tuning.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::meshless {

double ImplicitSolver::Group::tolerance() const {
    const double share = forces->empty() ? 1 : tuning::solve::contact_tolerance_share;
    return tolerance_factor * share * jobs[0].options.tolerance;
}

// Returns the squared residual at which a solve may end early, given the largest one so far. tight_square:
// target of the tolerance. With contacts it does not exceed that of the plain tolerance.
double ImplicitSolver::Group::loose_square(double tight_square) const {
    const double times = forces->empty() ? tuning::solve::max_loose_factor
                                         : 1 / (tolerance_factor * tuning::solve::contact_tolerance_share);
    return std::min(times * times * tight_square,
                    tuning::solve::fall_share * tuning::solve::fall_share * max_square);
}

double ImplicitSolver::Group::wanted_residual() {
    double target_square = 0;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        target_square += s.wanted_residual(job, tolerance());
    });
    return target_square;
}

// Computes r = b - A d of all bodies; returns its squared norm in the metric of the inverse diagonal.
// noise: estimate of the rounding error in that. exact: in double precision.
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
    if (!forces->empty()) forces->apply(solution, matrix_product);
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        double member_noise = 0;
        square += s.residual_from_product(job, exact, member_noise);
        noise += member_noise;
    });
    return square;
}

// Computes the residual from the solution, in double precision if rounding in single precision would
// dominate.
double ImplicitSolver::Group::first_residual(double target_square) {
    double noise = 0;
    double square = residual(false, noise);
    if (noise > tuning::solve::noise_share * target_square) square = residual(true, noise);
    max_square = square;
    return square;
}

// Returns the squared norm of the residual r that the last solve left.
double ImplicitSolver::Group::kept_residual() {
    double square = 0;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        square += s.squared_norm(job, s.vectors_.r);
    });
    max_square = std::max(max_square, square);
    return square;
}

// Weighs the aggregates again if the springs changed substantially; small changes hardly affect the coarse
// part.
void ImplicitSolver::Group::reweigh_aggregates() {
    if (std::abs(spring_stiffness - weighed_stiffness) <= tuning::solve::reweighing_share * weighed_stiffness)
        return;
    weighed_stiffness = spring_stiffness;
    each([](ImplicitSolver& s, const Job& job, std::uint32_t) { s.compute_aggregate_weights(job); });
}

// Solves from d; entries of held phyxels stay. from_solution: recomputes the residual from d; otherwise r is
// the residual.
void ImplicitSolver::Group::solve(bool from_solution) {
    const double tight_square = wanted_residual();
    each([](ImplicitSolver& s, const Job&, std::uint32_t) { ++s.report_.solves; });
    int iterations_left = jobs[0].options.max_iterations;
    double square = from_solution ? first_residual(tight_square) : kept_residual();
    const double early_factor =
        tolerance_factor > 1 ? (from_solution ? tuning::solve::first_early_share : tuning::solve::early_share)
                             : 0;
    const double target_square =
        std::max({tight_square, loose_square(tight_square), early_factor * early_factor * square});
    if (!from_solution && target_square < tuning::solve::single_precision_share * max_square)
        square = first_residual(target_square);
    if (from_solution) weighed_stiffness = -1;
    if (square > target_square) reweigh_aggregates();
    for (int pass = 0; pass < tuning::solve::max_refinements && square > target_square && iterations_left > 0;
         ++pass) {
        // Limits the reduction to what single precision can reach at a time.
        const bool is_in_reach = target_square >= tuning::solve::single_precision_share * square;
        const double before = square;
        square = conjugate_gradients(
            is_in_reach ? target_square : tuning::solve::single_precision_share * square, iterations_left);
        if (is_in_reach) break;
        double noise = 0;
        square = max_square = residual(true, noise);
        if (!(square < 0.25 * before)) break;
    }
    double reached = square > 0 && tight_square > 0 ? tolerance() * std::sqrt(square / tight_square) : 0;
    // A solve that reached its early target is reported as within the tolerance.
    if (square <= target_square) reached = std::min(reached, jobs[0].options.tolerance);
    each([&](ImplicitSolver& s, const Job&, std::uint32_t) { s.report_.residual = reached; });
}

// Loads the residual and starts a new direction; returns the squared norm of the residual in the metric of
// the inverse diagonal.
double ImplicitSolver::Group::begin_direction() {
    double square = 0;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        s.load_residual(job);
        square += s.sum_slices(job, [&](const SliceRange& range) {
            return meshless::begin_direction(s.elastic_.stride(), range, s.cg_.inverse.data(), s.cg_.r.data(),
                                             s.cg_.p.data());
        });
    });
    return square;
}

// Computes A p for the direction p; returns p . A p.
double ImplicitSolver::Group::apply_to_direction() {
    double product = 0;
    rows.clear();
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        const auto factor = static_cast<float>(1 + s.damping_ratio(job));
        product += s.elastic_.apply_stiffness(factor, s.cg_.diagonal.data(), s.cg_.p.data(), s.cg_.q.data(),
                                              job.parallel);
        rows.push_back({s.elastic_.stride(), s.cg_.p.data(), s.cg_.q.data()});
    });
    if (!forces->empty()) product += forces->products().apply(rows, jobs[0].parallel);
    each([](ImplicitSolver& s, const Job&, std::uint32_t) { s.filter(); });
    return product;
}

// Updates the list of springs for the products, and the diagonals that go with it.
void ImplicitSolver::Group::list_springs() {
    if (forces->empty()) return;
    if (!forces->list_springs() && are_diagonals_set) return;
    are_diagonals_set = true;
    slow.clear_springs();
    diagonals.clear();
    each([&](ImplicitSolver& s, const Job&, std::uint32_t) {
        diagonals.push_back({s.system_.mobility, s.system_.inverse, s.conditions_.held});
    });
    forces->products().set_diagonals(diagonals);
}

// Sets the row arrays of the smoother: from residual to direction.
void ImplicitSolver::Group::take_smoothing_rows() {
    rows.clear();
    each([&](ImplicitSolver& s, const Job&, std::uint32_t) {
        rows.push_back({s.elastic_.stride(), s.cg_.r.data(), s.cg_.p.data()});
    });
}

// Applies the springs' part of the preconditioner; returns its product with the residual.
double ImplicitSolver::Group::smooth() {
    if (forces->empty()) return 0;
    take_smoothing_rows();
    return forces->products().smooth(rows, jobs[0].parallel);
}

// Moves by alpha along the direction; returns the squared norm of the new residual, as begin_direction.
double ImplicitSolver::Group::advance(float alpha) {
    double square = 0;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        square += s.sum_slices(job, [&](const SliceRange& range) {
            return meshless::advance(s.elastic_.stride(), range, alpha, s.cg_.inverse.data(), s.cg_.p.data(),
                                     s.cg_.q.data(), s.cg_.d.data(), s.cg_.r.data());
        });
    });
    return square;
}

// Applies the coarse part of the preconditioner; returns its product with the residual.
double ImplicitSolver::Group::correct() {
    double square = 0;
    if (slow.blocks.is_built()) {
        take_smoothing_rows();
        square += slow.blocks.correct(rows, jobs[0].parallel);
    }
    if (slow.modes.is_built()) {
        take_smoothing_rows();
        return square + slow.modes.correct(rows, jobs[0].parallel);
    }
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        square += s.aggregates_.correct(s.cg_.r.data(), job.parallel);
    });
    return square;
}

void ImplicitSolver::Group::update_direction(float beta) {
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        const CoarsePart coarse{s.aggregates_.index(), s.aggregates_.correction(), s.aggregates_.count() + 1};
        for_slices(job.parallel, s.elastic_.slice_count(), [&](const SliceRange& range) {
            meshless::update_direction(s.elastic_.stride(), range, beta, s.cg_.inverse.data(), s.cg_.r.data(),
                                       coarse, s.cg_.p.data());
        });
    });
    if (slow.modes.is_built()) {
        take_smoothing_rows();
        slow.modes.add_correction(rows, jobs[0].parallel);
    }
    if (slow.blocks.is_built()) {
        take_smoothing_rows();
        slow.blocks.add_correction(rows, jobs[0].parallel);
    }
    if (forces->empty()) return;
    take_smoothing_rows();
    forces->products().add_smoothed(rows);
}

// Returns the number of iterations after which rigid modes pay, as factorising them takes longer for more
// aggregates.
int ImplicitSolver::Group::iterations_without_modes() {
    std::size_t count = 0;
    each([&](ImplicitSolver& s, const Job&, std::uint32_t) { count += s.aggregates_.count(); });
    return tuning::solve::iterations_without_modes +
           static_cast<int>(tuning::solve::iterations_per_aggregate * static_cast<double>(count));
}

// Returns the number of iterations in a step after which blocks pay: factorising takes longer for larger
// aggregates.
int ImplicitSolver::Group::iterations_without_blocks() {
    std::size_t count = 1, phyxels = 0;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        count += s.aggregates_.count();
        phyxels += job.phyxels.size();
    });
    return static_cast<int>(tuning::solve::iterations_per_block_size * static_cast<double>(phyxels / count));
}

// Bodies whose solves are slow without rigid modes stay so for many steps: iterating without them again would
// be in vain.
void ImplicitSolver::Group::recall_slow_steps() {
    each([&](ImplicitSolver&, const Job& job, std::uint32_t) {
        slow.need_modes = slow.need_modes || job.phyxels.slow_steps > 0;
    });
}

void ImplicitSolver::Group::count_slow_steps() {
    int left = 0;
    each([&](ImplicitSolver&, const Job& job, std::uint32_t) {
        left = std::max(left, job.phyxels.slow_steps);
    });
    if (left > 0)
        --left;
    else if (slow.need_modes)
        left = tuning::solve::steps_with_modes;
    each([&](ImplicitSolver&, const Job& job, std::uint32_t) { job.phyxels.slow_steps = left; });
}

std::vector<RigidModes::Part> ImplicitSolver::Group::coarse_parts() {
    std::vector<RigidModes::Part> out;
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t) {
        out.push_back({job.neighbourhoods, s.aggregates_, s.elastic_, job.phyxels.rest_position,
                       s.system_.base, s.system_.diagonal, 1 + s.damping_ratio(job)});
    });
    return out;
}

void ImplicitSolver::Group::build_modes() {
    each([](ImplicitSolver& s, const Job&, std::uint32_t) { s.aggregates_.clear_correction(); });
    slow.modes.build(coarse_parts(), forces->empty() ? nullptr : &forces->products());
}

void ImplicitSolver::Group::build_blocks() {
    slow.blocks.build(coarse_parts(), forces->empty() ? nullptr : &forces->products(), jobs[0].parallel);
}

// Iterates until the squared residual r is at most `goal` or `limit` iterations are done, and adds the
// correction to d; returns the squared residual reached.
double ImplicitSolver::Group::iterate(double goal, int& iterations_left, int limit) {
    double square = begin_direction();
    double rz = square + correct() + smooth();
    update_direction(0);
    while (square > goal && iterations_left > 0 && limit > 0) {
        const double curvature = apply_to_direction();
        if (!(curvature > 0) || !std::isfinite(curvature)) break;
        const double next = advance(static_cast<float>(rz / curvature));
        if (!std::isfinite(next)) break;
        square = next;
        ++solvers[0]->report_.iterations;
        --iterations_left;
        --limit;
        if (square <= goal) break;
        const double next_rz = square + correct() + smooth();
        update_direction(static_cast<float>(next_rz / rz));
        rz = next_rz;
    }
    each([](ImplicitSolver& s, const Job& job, std::uint32_t) { s.add_correction(job); });
    return square;
}

// Runs conjugate gradients until the squared residual r is at most `goal` and adds the correction to d;
// returns the squared residual reached. Solves that turn out to be slow go on with the rigid modes of the
// aggregates, and then with exact solves of them, as do the following solves of the step.
double ImplicitSolver::Group::conjugate_gradients(double goal, int& iterations_left) {
    list_springs();
    if (!slow.need_modes) {
        const double square = iterate(goal, iterations_left, iterations_without_modes());
        if (!(square > goal) || iterations_left == 0) return square;
        slow.need_modes = true;
    }
    if (!slow.modes.is_built()) build_modes();
    if (!slow.need_blocks) {
        const int before = iterations_left;
        const double square =
            iterate(goal, iterations_left, iterations_without_blocks() - slow.iterations_with_modes);
        slow.iterations_with_modes += before - iterations_left;
        if (!(square > goal) || iterations_left == 0) return square;
        slow.need_blocks = true;
    }
    if (!slow.blocks.is_built()) build_blocks();
    return iterate(goal, iterations_left, iterations_left);
}

}  // namespace splitcubes::meshless
