#include <splitcubes/meshless/implicit_solver.h>
#include <splitcubes/meshless/tuning.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

namespace splitcubes::meshless {

void ImplicitSolver::linearise(const Job& job) {
    elastic_.take_state(job.neighbourhoods, job.material,
                        {job.phyxels.rest_position, base_, job.phyxels.rotation, job.phyxels.plastic_strain},
                        job.parallel);
    is_exact_linearised_ = false;
    compute_rhs(job);
}

// Returns whether the solve distorted a neighbourhood that was undistorted where it began: a neighbourhood
// that rotates far in one step grows, since the linearised motion runs along straight lines.
bool ImplicitSolver::has_new_distortion(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    const std::size_t n = phyxels.size();
    has_solution_state_ = false;
    const double far_count = sum_(job.parallel, n, [&](std::size_t begin, std::size_t end) {
        double count = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const double limit = tuning::guess::distortion_check_share * phyxels.support_radius[i];
            count += d_[i].squaredNorm() > limit * limit;
        }
        return count;
    });
    if (far_count == 0) return false;
    for_phyxels(job.parallel, n, [&](std::size_t i) { p_[i] = base_[i] + d_[i]; });
    undistorted_.resize(n);
    for (std::size_t i = 0; i < n; ++i) undistorted_[i] = !elastic_.is_distorted(i);
    elastic_.take_state(job.neighbourhoods, job.material,
                        {phyxels.rest_position, p_, phyxels.rotation, phyxels.plastic_strain}, job.parallel);
    for (std::size_t i = 0; i < n; ++i)
        if (undistorted_[i] != 0 && elastic_.is_distorted(i)) return true;
    has_solution_state_ = true;
    return false;
}

void ImplicitSolver::size_buffers(std::size_t count) {
    for (auto* array : {&b_, &diagonal_, &mobility_, &inverse_}) array->resize(count);
    for (auto* array : {&predicted_, &predicted_velocity_, &base_, &start_position_, &start_velocity_, &rhs_,
                        &spring_force_, &d_, &r_, &p_, &q_})
        array->resize(count);
    failed_.assign(count, 0);
    for (auto* array : {&inverted_, &held_, &high_acceleration_}) array->resize(count);
    to_smooth_.reserve(count);
}

// Determines what the choice of step sizes and the initial guess depend on.
void ImplicitSolver::find_step_conditions(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    supported_.assign(static_cast<std::size_t>(job.input.piece_count) + 1, 0);
    any_inverted_ =
        sum_(job.parallel, phyxels.size(), [&](std::size_t begin, std::size_t end) {
            double count = 0;
            for (std::size_t i = begin; i < end; ++i) {
                inverted_[i] = !(phyxels.deformation[i].determinant() > 0);
                held_[i] = !job.input.held.empty() && job.input.held[i] != 0;
                spring_force_[i].setZero();
                count += inverted_[i];
                if ((held_[i] | phyxels.touching[i]) != 0)
                    std::atomic_ref(supported_[piece_of(job, i)]).store(1, std::memory_order_relaxed);
            }
            return count;
        }) > 0;
}

// Chooses BDF2 or backward Euler for a phyxel.
void ImplicitSolver::choose_step_size(const Job& job, std::size_t i) {
    const Phyxels& phyxels = job.phyxels;
    const bool has_history = job.options.bdf2 && phyxels.history_step == job.input.dt;
    const std::span<const std::uint32_t> offsets = job.neighbourhoods.offsets();
    bool beside_inverted = inverted_[i] != 0;
    for (std::uint32_t l = offsets[i]; any_inverted_ && l < offsets[i + 1] && has_history && !beside_inverted;
         ++l)
        beside_inverted =
            inverted_[job.neighbourhoods.neighbour()[l]] != 0 && job.neighbourhoods.weight()[l] > 0;
    const bool two_steps = has_history && phyxels.restart_history[i] == 0 && held_[i] == 0 &&
                           !beside_inverted && hit_[piece_of(job, i)] == 0;
    b_[i] = two_steps ? 2 * job.input.dt / 3 : job.input.dt;
}

// Predicts a phyxel without elastic force. Gravity is included, so that nothing is left to solve in free
// fall.
void ImplicitSolver::predict_phyxel(const Job& job, std::size_t i) {
    const Phyxels& phyxels = job.phyxels;
    const double dt = job.input.dt;
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
    if (held_[i] != 0) {
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
}

// One loop over everything that is read of the motion: the arrays exceed the caches.
void ImplicitSolver::predict(const Job& job) {
    for_phyxels(job.parallel, job.phyxels.size(), [&](std::size_t i) {
        choose_step_size(job, i);
        predict_phyxel(job, i);
        guess_acceleration(job, i);
    });
}

// Computes the right side: -dE/dx and damping forces at the base, minus the inertia of the displacement from
// prediction to base.
void ImplicitSolver::compute_rhs(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    const double damping = job.material.stiffness_damping;
    const float* const found = elastic_.forces(job.parallel);
    const auto force_of = [&](std::size_t i) -> Vec3 {
        const std::size_t n = elastic_.stride();
        return Vec3f(found[i], found[n + i], found[2 * n + i]).cast<double>();
    };
    if (damping > 0) {
        for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) { rhs_[i] = force_of(i); });
        for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
            p_[i] = predicted_velocity_[i] + (base_[i] - predicted_[i]) / b_[i];
            mobility_[i] = 0;
        });
        elastic_.apply_stiffness(damping, mobility_, p_, q_, job.parallel);
    }
    for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
        if (!(damping > 0)) rhs_[i] = force_of(i);
        rhs_[i] -= diagonal_[i] * (base_[i] - predicted_[i]);
        rhs_[i] -= job.material.mass_damping * phyxels.mass[i] * predicted_velocity_[i];
        if (damping > 0) rhs_[i] -= q_[i];
        if (!rhs_[i].allFinite()) {
            rhs_[i].setZero();
            failed_[i] = 1;
        }
        const double total =
            diagonal_[i] + (1 + damping_ratio(job)) * job.neighbourhoods.stiffness_diagonal()[i];
        mobility_[i] = total > 0 ? 1 / total : 0;
    });
}

// Writes the acceleration minus gravity of the last step to p_, or a substitute if that does not continue.
void ImplicitSolver::guess_acceleration(const Job& job, std::size_t i) {
    const Phyxels& phyxels = job.phyxels;
    const bool has_history = phyxels.history_step == job.input.dt;
    const bool supported = supported_[piece_of(job, i)] != 0;
    p_[i].setZero();
    high_acceleration_[i] = 0;
    if (!job.options.warm_start || !(has_history || supported)) return;
    Vec3 acceleration = (phyxels.velocity[i] - phyxels.previous_velocity[i]) / job.input.dt;
    // The velocity jump of an impact does not continue as an acceleration.
    if (!has_history || phyxels.restart_history[i] != 0)
        acceleration = supported ? Vec3(Vec3::Zero()) : job.input.gravity;
    const Vec3 less_gravity = acceleration - job.input.gravity;
    if (!less_gravity.allFinite()) return;
    p_[i] = less_gravity;
    high_acceleration_[i] = supported && has_high_acceleration(job, less_gravity);
}

// Starts from the correction that keeps the last step's acceleration: it is the solution for a body that
// hangs, rests or rotates steadily. For a piece that is held or supported it becomes the point of
// linearisation. The prediction would let such a piece fall past its support by b^2 g and shear the adjacent
// phyxels so much that a solve linearised there ends elsewhere, and elsewhere for each b.
void ImplicitSolver::start_guess(const Job& job) {
    smooth_high_accelerations(job);
    for_phyxels(job.parallel, job.phyxels.size(), [&](std::size_t i) {
        d_[i].setZero();
        if (held_[i] != 0) return;
        if (supported_[piece_of(job, i)] != 0)
            base_[i] += b_[i] * b_[i] * p_[i];
        else
            d_[i] = b_[i] * b_[i] * p_[i];
    });
}

bool ImplicitSolver::has_high_acceleration(const Job& job, const Vec3& acceleration_less_gravity) {
    const double threshold = tuning::guess::smoothing_threshold * job.input.gravity.norm();
    return acceleration_less_gravity.squaredNorm() > threshold * threshold;
}

// Smooths p_, the accelerations minus gravity, in two passes: high accelerations of pieces that are
// linearised at the guess are averaged with their neighbours. Material freed by a cut springs back at
// hundreds of m/s^2 in one step and as much the other way in the next; linearised at a continuation of that,
// it would be torn from its neighbours.
void ImplicitSolver::smooth_high_accelerations(const Job& job) {
    const Neighbourhoods& links = job.neighbourhoods;
    to_smooth_.clear();
    for (std::uint32_t i = 0; i < high_acceleration_.size(); ++i)
        if (high_acceleration_[i] != 0) to_smooth_.push_back(i);
    const auto mean_around = [&](std::size_t i) {
        Vec3 sum = Vec3::Zero();
        double weight = 0;
        for (std::uint32_t l = links.offsets()[i]; l < links.offsets()[i + 1]; ++l) {
            sum += links.weight()[l] * p_[links.neighbour()[l]];
            weight += links.weight()[l];
        }
        return weight > 0 ? Vec3(tuning::guess::smoothing_own_weight * p_[i] +
                                 (1 - tuning::guess::smoothing_own_weight) / weight * sum)
                          : p_[i];
    };
    for (int pass = 0; pass < 2; ++pass) {
        for_phyxels(job.parallel, to_smooth_.size(), [&](std::size_t k) {
            const std::size_t i = to_smooth_[k];
            q_[k] = has_high_acceleration(job, p_[i]) ? mean_around(i) : p_[i];
        });
        for_phyxels(job.parallel, to_smooth_.size(), [&](std::size_t k) { p_[to_smooth_[k]] = q_[k]; });
    }
}

// Returns the force if the phyxel is free, zero if it is held.
Vec3 ImplicitSolver::filtered(std::size_t i, const Vec3& force) const {
    return held_[i] != 0 ? Vec3(Vec3::Zero()) : force;
}

double ImplicitSolver::damping_ratio(const Job& job) const {
    const double b = job.options.bdf2 ? 2 * job.input.dt / 3 : job.input.dt;
    return job.material.stiffness_damping / b;
}

// Returns the squared residual, in the norm of the inverse diagonal, that ends a solve: the tolerance's share
// of the right side, but at most ten times that share of the forces of gravity and of the last step's
// acceleration. The right side grows with stiffness when a held or supported body was predicted to fall; by
// that measure alone a stiff body would ignore its weight. When the solve begins at a guess, the right side
// is only the error of the guess, so the inertia forces of the base count as well.
double ImplicitSolver::wanted_residual(const Job& job, double tolerance) {
    const Phyxels& phyxels = job.phyxels;
    const auto chunk = [&](std::size_t begin, std::size_t end) {
        ToleranceSums sums;
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3 base_force = filtered(i, diagonal_[i] * (base_[i] - predicted_[i]));
            sums.right += inverse_[i] * filtered(i, rhs_[i] + spring_force_[i]).squaredNorm();
            sums.base += inverse_[i] * base_force.squaredNorm();
            const Vec3 acceleration = (start_velocity_[i] - phyxels.previous_velocity[i]) / job.input.dt;
            const double force = phyxels.mass[i] * (acceleration.norm() + job.input.gravity.norm());
            sums.inertial += inverse_[i] * force * force;
            const double correction = tuning::solve::smallest_correction * phyxels.support_radius[i];
            sums.rounding += inverse_[i] > 0 ? correction * correction / inverse_[i] : 0;
        }
        return sums;
    };
    const ToleranceSums sums = wanted_sum_(job.parallel, phyxels.size(), phyxel_grain, chunk);
    const double right = std::max(sums.right, 100 * sums.base);
    const double scale = sums.inertial > 0 ? std::min(right, 100 * sums.inertial) : right;
    return std::max(tolerance * tolerance * scale, sums.rounding);
}

// Returns whether d_ is zero.
bool ImplicitSolver::is_at_base(const Job& job) {
    return sum_(job.parallel, d_.size(), [&](std::size_t begin, std::size_t end) {
               double count = 0;
               for (std::size_t i = begin; i < end; ++i) count += !d_[i].isZero(0);
               return count;
           }) == 0;
}

// Computes q_ = A d_ without the contacts.
void ImplicitSolver::stiffness_times_solution(const Job& job, bool exact) {
    const std::size_t n = job.phyxels.size();
    const double factor = 1 + damping_ratio(job);
    if (exact && !is_exact_linearised_) {
        deformation_.resize(n);
        rotation_.resize(n);
        compute_deformation(job.neighbourhoods, job.phyxels.rest_position, base_, job.phyxels.rotation,
                            deformation_, rotation_, job.parallel);
        exact_.linearise(job.neighbourhoods, job.material,
                         {base_, deformation_, rotation_, job.phyxels.plastic_strain}, job.parallel);
        is_exact_linearised_ = true;
    }
    if (exact)
        exact_.apply_stiffness(job.neighbourhoods, job.material, factor, diagonal_, d_, q_, job.parallel);
    else
        elastic_.apply_stiffness(factor, diagonal_, d_, q_, job.parallel);
}

// Returns the squared norm in the metric of the inverse diagonal.
double ImplicitSolver::squared_norm(const Job& job, std::span<const Vec3> of) {
    return sum_(job.parallel, of.size(), [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += inverse_[i] * of[i].squaredNorm();
        return sum;
    });
}

// Computes the residual for d_ = 0; returns its squared norm.
double ImplicitSolver::residual_at_base(const Job& job) {
    return sum_(job.parallel, r_.size(), [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) {
            r_[i] = filtered(i, rhs_[i] + spring_force_[i]);
            sum += inverse_[i] * r_[i].squaredNorm();
        }
        return sum;
    });
}

// Computes the residual from q_ = A d_; returns its squared norm. noise: estimate of its rounding error.
double ImplicitSolver::residual_from_product(const Job& job, bool exact, double& noise) {
    noise = exact ? 0 : tuning::solve::rounding_share * tuning::solve::rounding_share * squared_norm(job, q_);
    for_phyxels(job.parallel, q_.size(),
                [&](std::size_t i) { r_[i] = filtered(i, rhs_[i] + spring_force_[i] - q_[i]); });
    return squared_norm(job, r_);
}

void ImplicitSolver::load_residual(const Job& job) {
    const std::size_t n = job.phyxels.size(), stride = elastic_.stride();
    const auto size = [](FloatArray& array, std::size_t length) {
        if (array.size() != length) array.assign(length, 0);
    };
    for (FloatArray* array : {&float_d_, &float_r_, &float_p_, &float_q_}) size(*array, 3 * stride);
    for (FloatArray* array : {&float_diagonal_, &float_inverse_}) size(*array, stride);
    constrained_.clear();
    for (std::size_t i = 0; i < n; ++i)
        if (held_[i] != 0) constrained_.push_back(static_cast<std::uint32_t>(i));
    for_phyxels(job.parallel, n, [&](std::size_t i) {
        float_diagonal_[i] = static_cast<float>(diagonal_[i]);
        float_inverse_[i] = static_cast<float>(inverse_[i]);
        for (std::size_t k = 0; k < 3; ++k) {
            float_r_[k * stride + i] = static_cast<float>(r_[i][static_cast<int>(k)]);
            float_d_[k * stride + i] = 0;
        }
    });
}

// Zeroes the entries of held phyxels in float_q_.
void ImplicitSolver::filter() {
    const std::size_t stride = elastic_.stride();
    for (const std::uint32_t i : constrained_)
        for (std::size_t k = 0; k < 3; ++k) float_q_[k * stride + i] = 0;
}

// Updates the coarse part of the preconditioner.
void ImplicitSolver::compute_aggregate_weights(const Job& job) {
    aggregates_.update(job.phyxels, job.neighbourhoods, held_, job.parallel);
    aggregates_.compute_weights(job.neighbourhoods, 1 + damping_ratio(job), diagonal_, spring_stiffness_,
                                job.parallel);
}

// Adds the correction that conjugate gradients found to d_ and stores their residual in r_.
void ImplicitSolver::add_correction(const Job& job) {
    const std::size_t stride = elastic_.stride();
    for_phyxels(job.parallel, job.phyxels.size(), [&](std::size_t i) {
        for (std::size_t k = 0; k < 3; ++k) {
            d_[i][static_cast<int>(k)] += static_cast<double>(float_d_[k * stride + i]);
            r_[i][static_cast<int>(k)] = static_cast<double>(float_r_[k * stride + i]);
        }
    });
}

// Writes the new position, velocity and history of one phyxel.
void ImplicitSolver::finish_phyxel(const Job& job, std::size_t i) {
    Phyxels& phyxels = job.phyxels;
    Vec3 x = base_[i] + d_[i];
    Vec3 v = predicted_velocity_[i] + (x - predicted_[i]) / b_[i];
    if (!x.allFinite() || !v.allFinite()) failed_[i] = 1;
    if (failed_[i] != 0) {
        x = predicted_[i];
        v = predicted_velocity_[i];
    }
    phyxels.previous_position[i] = start_position_[i];
    phyxels.previous_velocity[i] = start_velocity_[i];
    phyxels.position[i] = x;
    phyxels.velocity[i] = v;
    // BDF2 would extrapolate the velocity jump of an impact.
    phyxels.restart_history[i] = held_[i] != 0 || failed_[i] != 0 || hit_[piece_of(job, i)] != 0;
}

// Returns the phyxel's piece, or piece_count if it is out of range.
std::size_t ImplicitSolver::piece_of(const Job& job, std::size_t i) const {
    const std::int32_t piece = job.phyxels.piece[i];
    return static_cast<std::size_t>(piece >= 0 && piece < job.input.piece_count ? piece
                                                                                : job.input.piece_count);
}

}  // namespace splitcubes::meshless
