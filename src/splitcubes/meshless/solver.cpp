#include <splitcubes/meshless/solver.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace splitcubes::meshless {

namespace {

// Corrections below this share of the support radius are rounding: a solve ends there.
constexpr double smallest_correction = 1e-10;
// Corrections above this share of the support radius may have turned something by far.
constexpr double far_share = 0.2;
// Share of A d that single precision may lose.
constexpr double rounding_share = 1e-6;
// Share of the wanted square of the residual that rounding may make up.
constexpr double noise_share = 0.1;
// Share that the square of a residual falls by before it is taken again in double precision.
constexpr double reach_share = 1e-8;

}  // namespace

SolverReport ImplicitSolver::step(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                  const Material& material, const StepInput& input,
                                  const SolverOptions& options, const Parallel& parallel) {
    check_step_input(phyxels, input);
    assert(neighbourhoods.size() == phyxels.size());
    const Job job{phyxels, neighbourhoods, material, input, options, parallel};
    report_ = SolverReport{};
    size_buffers(phyxels.size());
    choose_steps(job);
    predict(job);
    momenta_.begin(phyxels, input.piece_count, parallel);
    meet_ground(job);
    linearise(job);
    start_guess(job);
    solve_with_contacts(job);
    for (int pass = 0; pass < max_distorted_passes && (pass < options.further_solves || is_torn(job));
         ++pass) {
        for_phyxels(parallel, phyxels.size(), [&](std::size_t i) {
            base_[i] += d_[i];
            d_[i].setZero();
            // Found from the pressure of a solve that tore: it would fling what it holds.
            friction_[i].setZero();
        });
        linearise(job);
        solve_with_contacts(job);
    }
    for_phyxels(parallel, phyxels.size(), [&](std::size_t i) { finish_phyxel(job, i); });
    for (std::size_t i = 0; i < phyxels.size(); ++i) report_.non_finite += failed_[i];
    break_histories(job);
    if (options.restore_momentum) restore_momenta(job);
    phyxels.history_step = input.dt;
    deform_and_flow(phyxels, neighbourhoods, material, input.dt, elastic_, parallel);
    describe_(phyxels, neighbourhoods, elastic_, report_, parallel);
    for (const Mode mode : mode_) report_.contacts += mode == Mode::stick || mode == Mode::slide;
    return report_;
}

void ImplicitSolver::linearise(const Job& job) {
    elastic_.take_state(job.neighbourhoods, job.material,
                        {job.phyxels.rest_position, base_, job.phyxels.rotation, job.phyxels.plastic_strain},
                        job.parallel);
    exact_is_taken_ = false;
    right_side(job);
}

void ImplicitSolver::solve_with_contacts(const Job& job) {
    solve(job);
    for (int pass = 0; pass < max_contact_passes && revise_contacts(job); ++pass) solve(job);
}

// Whether the solve has torn a neighbourhood that was whole where it began: one that it
// turns by far in a step grows, since it is turned along straight lines.
bool ImplicitSolver::is_torn(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    const std::size_t n = phyxels.size();
    bool far = false;
    for (std::size_t i = 0; i < n && !far; ++i) far = d_[i].norm() > far_share * phyxels.support_radius[i];
    if (!far) return false;
    for_phyxels(job.parallel, n, [&](std::size_t i) { p_[i] = base_[i] + d_[i]; });
    whole_.resize(n);
    for (std::size_t i = 0; i < n; ++i) whole_[i] = !elastic_.is_distorted(i);
    elastic_.take_state(job.neighbourhoods, job.material,
                        {phyxels.rest_position, p_, phyxels.rotation, phyxels.plastic_strain}, job.parallel);
    for (std::size_t i = 0; i < n; ++i)
        if (whole_[i] != 0 && elastic_.is_distorted(i)) return true;
    return false;
}

void ImplicitSolver::size_buffers(std::size_t count) {
    for (auto* array : {&b_, &diagonal_, &inverse_}) array->resize(count);
    for (auto* array : {&predicted_, &predicted_velocity_, &base_, &start_position_, &start_velocity_,
                        &right_, &friction_, &d_, &r_, &p_, &q_})
        array->resize(count);
    for (auto* array : {&inverted_, &touched_, &met_, &failed_}) array->assign(count, 0);
    mode_.resize(count);
}

// Which phyxels step by BDF2 and which by backward Euler.
void ImplicitSolver::choose_steps(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    const bool history = job.options.bdf2 && phyxels.history_step == job.input.dt;
    for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
        inverted_[i] = !(phyxels.deformation[i].determinant() > 0);
        const bool held = !job.input.held.empty() && job.input.held[i] != 0;
        mode_[i] = held ? Mode::held : Mode::free;
        friction_[i].setZero();
    });
    const bool any_inverted = std::find(inverted_.begin(), inverted_.end(), 1) != inverted_.end();
    const std::span<const std::uint32_t> offsets = job.neighbourhoods.offsets();
    for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
        bool beside_inverted = inverted_[i] != 0;
        for (std::uint32_t l = offsets[i]; any_inverted && l < offsets[i + 1] && history && !beside_inverted;
             ++l)
            beside_inverted =
                inverted_[job.neighbourhoods.neighbour()[l]] != 0 && job.neighbourhoods.weight()[l] > 0;
        const bool two_steps =
            history && phyxels.history_broken[i] == 0 && mode_[i] == Mode::free && !beside_inverted;
        b_[i] = two_steps ? 2 * job.input.dt / 3 : job.input.dt;
    });
}

// Where the phyxels would be without elastic force; gravity included, so that in
// free fall nothing is left to solve.
void ImplicitSolver::predict(const Job& job) {
    Phyxels& phyxels = job.phyxels;
    const double dt = job.input.dt;
    for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
        const Vec3& x = phyxels.position[i];
        const Vec3& v = phyxels.velocity[i];
        const double b = b_[i];
        const bool two_steps = b < dt;
        start_position_[i] = x;
        start_velocity_[i] = v;
        // 4/3 a - 1/3 a' written as a + (a - a')/3: exact where nothing moves.
        const Vec3 old_x = two_steps ? Vec3(x + (x - phyxels.previous_position[i]) / 3) : x;
        const Vec3 old_v = two_steps ? Vec3(v + (v - phyxels.previous_velocity[i]) / 3) : v;
        predicted_velocity_[i] = old_v + b * job.input.gravity;
        predicted_[i] = old_x + b * predicted_velocity_[i];
        if (mode_[i] == Mode::held) {
            predicted_[i] = job.input.held_position[i];
            predicted_velocity_[i] = (predicted_[i] - x) / dt;
        }
        if (!predicted_[i].allFinite() || !predicted_velocity_[i].allFinite()) {
            failed_[i] = 1;
            predicted_velocity_[i].setZero();
            predicted_[i] = x.allFinite() ? x : phyxels.previous_position[i];
        }
        base_[i] = predicted_[i];
        const double m = phyxels.mass[i];
        diagonal_[i] = (1 + b * job.material.mass_damping) * m / (b * b);
    });
}

// -dE/dx and the dampings at the base, less what inertia says against the
// distance from prediction to base.
void ImplicitSolver::right_side(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    elastic_.forces(right_, job.parallel);
    const double damping = job.material.stiffness_damping;
    if (damping > 0) {
        for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
            p_[i] = predicted_velocity_[i] + (base_[i] - predicted_[i]) / b_[i];
            inverse_[i] = 0;
        });
        elastic_.apply_stiffness(damping, inverse_, p_, q_, job.parallel);
    }
    for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
        right_[i] -= diagonal_[i] * (base_[i] - predicted_[i]);
        right_[i] -= job.material.mass_damping * phyxels.mass[i] * predicted_velocity_[i];
        if (damping > 0) right_[i] -= q_[i];
        if (!right_[i].allFinite()) {
            right_[i].setZero();
            failed_[i] = 1;
        }
        const double all =
            diagonal_[i] + (1 + damping_ratio(job)) * job.neighbourhoods.stiffness_diagonal()[i];
        inverse_[i] = all > 0 ? 1 / all : 0;
    });
}

// The correction that would keep the last step's acceleration: where a body
// hangs, rests or turns it is the solution.
void ImplicitSolver::start_guess(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    const bool known = phyxels.history_step == job.input.dt;
    for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
        d_[i].setZero();
        if (mode_[i] != Mode::free || !known || !job.options.warm_start) return;
        const Vec3 acceleration = (phyxels.velocity[i] - phyxels.previous_velocity[i]) / job.input.dt;
        const Vec3 guess = b_[i] * b_[i] * (acceleration - job.input.gravity);
        if (guess.allFinite()) d_[i] = guess;
    });
}

// The part of a force that a phyxel is free to follow.
Vec3 ImplicitSolver::filtered(const Job& job, std::size_t i, const Vec3& force) const {
    switch (mode_[i]) {
        case Mode::held:
        case Mode::stick:
            return Vec3::Zero();
        case Mode::slide: {
            const Vec3& normal = job.input.ground->normal;
            return force - normal * normal.dot(force);
        }
        case Mode::free:
            break;
    }
    return force;
}

double ImplicitSolver::damping_ratio(const Job& job) const {
    const double b = job.options.bdf2 ? 2 * job.input.dt / 3 : job.input.dt;
    return job.material.stiffness_damping / b;
}

// The square of the residual, in the preconditioner's norm, that ends a solve: the
// tolerance's share of the right side, but no more than ten times that share of the
// forces that gravity and the last step's acceleration stand for. The right side
// grows with stiffness where a body that is held or stands was predicted to fall;
// measured by it alone a stiff body would not feel its weight.
double ImplicitSolver::wanted_residual(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    const auto chunk = [&](std::size_t begin, std::size_t end) {
        WantedSums sums;
        for (std::size_t i = begin; i < end; ++i) {
            sums.right += inverse_[i] * filtered(job, i, right_[i] + friction_[i]).squaredNorm();
            const Vec3 acceleration = (start_velocity_[i] - phyxels.previous_velocity[i]) / job.input.dt;
            const double force = phyxels.mass[i] * (acceleration.norm() + job.input.gravity.norm());
            sums.felt += inverse_[i] * force * force;
            const double correction = smallest_correction * phyxels.support_radius[i];
            sums.least += inverse_[i] > 0 ? correction * correction / inverse_[i] : 0;
        }
        return sums;
    };
    const WantedSums sums = wanted_sum_(job.parallel, phyxels.size(), phyxel_grain, chunk);
    const double scale = sums.felt > 0 ? std::min(sums.right, 100 * sums.felt) : sums.right;
    return std::max(job.options.tolerance * job.options.tolerance * scale, sums.least);
}

// r_ = b - A d_, its square in the preconditioner's norm returned. noise: what rounding may
// make of that. `exact`: in double precision.
double ImplicitSolver::residual(const Job& job, bool exact, double& noise) {
    const std::size_t n = job.phyxels.size();
    const double factor = 1 + damping_ratio(job);
    if (exact && !exact_is_taken_) {
        deformation_.resize(n);
        rotation_.resize(n);
        compute_deformation(job.neighbourhoods, job.phyxels.rest_position, base_, job.phyxels.rotation,
                            deformation_, rotation_, job.parallel);
        exact_.linearise(job.neighbourhoods, job.material,
                         {base_, deformation_, rotation_, job.phyxels.plastic_strain}, job.parallel);
        exact_is_taken_ = true;
    }
    if (exact)
        exact_.apply_stiffness(job.neighbourhoods, job.material, factor, diagonal_, d_, q_, job.parallel);
    else
        elastic_.apply_stiffness(factor, diagonal_, d_, q_, job.parallel);
    const auto squares = [&](const std::vector<Vec3>& of) {
        return sum_(job.parallel, n, [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            for (std::size_t i = begin; i < end; ++i) sum += inverse_[i] * of[i].squaredNorm();
            return sum;
        });
    };
    noise = exact ? 0 : rounding_share * rounding_share * squares(q_);
    for_phyxels(job.parallel, n,
                [&](std::size_t i) { r_[i] = filtered(job, i, right_[i] + friction_[i] - q_[i]); });
    return squares(r_);
}

// Conjugate gradients with point Jacobi, from d_; constrained parts of d_ stay.
void ImplicitSolver::solve(const Job& job) {
    ++report_.solves;
    const double wanted = wanted_residual(job);
    int left = job.options.max_iterations;
    double noise = 0;
    double rz = residual(job, false, noise);
    if (noise > noise_share * wanted) rz = residual(job, true, noise);
    for (int pass = 0; pass < max_refinements && rz > wanted && left > 0; ++pass) {
        // Single precision carries no further than this at a time.
        const bool in_reach = wanted >= reach_share * rz;
        const double before = rz;
        rz = descend(job, in_reach ? wanted : reach_share * rz, left);
        if (in_reach) break;
        rz = residual(job, true, noise);
        if (!(rz < 0.25 * before)) break;
    }
    report_.residual = rz > 0 && wanted > 0 ? job.options.tolerance * std::sqrt(rz / wanted) : 0;
}

void ImplicitSolver::take_residual(const Job& job) {
    const std::size_t n = job.phyxels.size(), stride = elastic_.stride();
    const auto size = [](FloatArray& array, std::size_t length) {
        if (array.size() != length) array.assign(length, 0);
    };
    for (FloatArray* array : {&fine_d_, &fine_r_, &fine_p_, &fine_q_}) size(*array, 3 * stride);
    for (FloatArray* array : {&fine_diagonal_, &fine_inverse_}) size(*array, stride);
    constrained_.clear();
    for (std::size_t i = 0; i < n; ++i)
        if (mode_[i] != Mode::free) constrained_.push_back(static_cast<std::uint32_t>(i));
    for_phyxels(job.parallel, n, [&](std::size_t i) {
        fine_diagonal_[i] = static_cast<float>(diagonal_[i]);
        fine_inverse_[i] = static_cast<float>(inverse_[i]);
        for (std::size_t k = 0; k < 3; ++k) {
            fine_r_[k * stride + i] = static_cast<float>(r_[i][static_cast<int>(k)]);
            fine_d_[k * stride + i] = 0;
        }
    });
}

// Takes off fine_q_ what constrained phyxels cannot follow.
void ImplicitSolver::filter(const Job& job) {
    const std::size_t stride = elastic_.stride();
    for (const std::uint32_t i : constrained_) {
        Vec3 force;
        for (std::size_t k = 0; k < 3; ++k)
            force[static_cast<int>(k)] = static_cast<double>(fine_q_[k * stride + i]);
        force = filtered(job, i, force);
        for (std::size_t k = 0; k < 3; ++k)
            fine_q_[k * stride + i] = static_cast<float>(force[static_cast<int>(k)]);
    }
}

// Adds to d_ what brings the square of the residual r_ down to `goal`; returns where it got.
double ImplicitSolver::descend(const Job& job, double goal, int& left) {
    const std::size_t stride = elastic_.stride();
    const auto factor = static_cast<float>(1 + damping_ratio(job));
    const auto sum = [&](const auto& chunk) {
        return slice_sum_(job.parallel, elastic_.slice_count(), slice_grain,
                          [&](std::size_t begin, std::size_t end) {
                              return chunk(SliceRange{begin, end});
                          });
    };
    take_residual(job);
    double rz = sum([&](const SliceRange& range) {
        return begin_direction(stride, range, fine_inverse_.data(), fine_r_.data(), fine_p_.data());
    });
    while (rz > goal && left > 0) {
        const double curvature = elastic_.apply_stiffness(factor, fine_diagonal_.data(), fine_p_.data(),
                                                          fine_q_.data(), job.parallel);
        filter(job);
        if (!(curvature > 0) || !std::isfinite(curvature)) break;
        const auto alpha = static_cast<float>(rz / curvature);
        const double next = sum([&](const SliceRange& range) {
            return advance(stride, range, alpha, fine_inverse_.data(), fine_p_.data(), fine_q_.data(),
                           fine_d_.data(), fine_r_.data());
        });
        if (!std::isfinite(next)) break;
        const auto beta = static_cast<float>(next / rz);
        rz = next;
        for_slices(job.parallel, elastic_.slice_count(), [&](const SliceRange& range) {
            turn_direction(stride, range, beta, fine_inverse_.data(), fine_r_.data(), fine_p_.data());
        });
        --left;
        ++report_.iterations;
    }
    for_phyxels(job.parallel, job.phyxels.size(), [&](std::size_t i) {
        for (std::size_t k = 0; k < 3; ++k)
            d_[i][static_cast<int>(k)] += static_cast<double>(fine_d_[k * stride + i]);
    });
    return rz;
}

// New position, velocity and history of one phyxel.
void ImplicitSolver::finish_phyxel(const Job& job, std::size_t i) {
    Phyxels& phyxels = job.phyxels;
    Vec3 x = base_[i] + d_[i];
    if (mode_[i] == Mode::free && below_ground(job, i, x)) x = touch_ground(job, i, x);
    Vec3 v = predicted_velocity_[i] + (x - predicted_[i]) / b_[i];
    if (!x.allFinite() || !v.allFinite()) failed_[i] = 1;
    if (failed_[i] != 0) {
        x = predicted_[i];
        v = predicted_velocity_[i];
    }
    if (mode_[i] == Mode::stick) v.setZero();
    if (mode_[i] == Mode::slide) {
        const Vec3& normal = job.input.ground->normal;
        v -= normal * normal.dot(v);
        // Friction lagged by a solve must not push a phyxel back.
        if (v.dot(friction_[i]) > 0) v.setZero();
    }
    phyxels.previous_position[i] = start_position_[i];
    phyxels.previous_velocity[i] = start_velocity_[i];
    phyxels.position[i] = x;
    phyxels.velocity[i] = v;
    const bool touches = mode_[i] == Mode::stick || mode_[i] == Mode::slide;
    met_[i] = touches != (phyxels.touching[i] != 0) || touches != (touched_[i] != 0);
    phyxels.history_broken[i] = mode_[i] == Mode::held || failed_[i] != 0;
    phyxels.touching[i] = touches;
}

// Meeting or leaving the ground breaks the history of the whole piece: one half of
// which steps by another rule hops. Resting and steady sliding do not.
void ImplicitSolver::break_histories(const Job& job) {
    Phyxels& phyxels = job.phyxels;
    if (!job.input.ground) return;
    broken_.assign(static_cast<std::size_t>(job.input.piece_count) + 1, 0);
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (met_[i] != 0) broken_[piece_of(job, i)] = 1;
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (broken_[piece_of(job, i)] != 0) phyxels.history_broken[i] = 1;
}

// The phyxel's piece; piece_count for those outside the range.
std::size_t ImplicitSolver::piece_of(const Job& job, std::size_t i) const {
    const std::int32_t piece = job.phyxels.piece[i];
    return static_cast<std::size_t>(piece >= 0 && piece < job.input.piece_count ? piece
                                                                                : job.input.piece_count);
}

// Gives every piece that is on its own the momenta that gravity and mass damping
// leave it.
void ImplicitSolver::restore_momenta(const Job& job) {
    for (std::size_t i = 0; i < job.phyxels.size(); ++i)
        if (mode_[i] != Mode::free || touched_[i] != 0 || failed_[i] != 0)
            momenta_.bind(job.phyxels.piece[i]);
    const double dt = job.input.dt;
    momenta_.restore(job.phyxels, 1 / (1 + dt * job.material.mass_damping), dt * job.input.gravity, b_, dt,
                     job.parallel);
}

}  // namespace splitcubes::meshless
