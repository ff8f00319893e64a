#include <splitcubes/meshless/implicit_solver.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

namespace splitcubes::meshless {

namespace {

// Corrections below this share of the support radius are rounding: a solve ends there.
constexpr double smallest_correction = 1e-10;
// Corrections above this share of the support radius may have turned something by far.
constexpr double far_share = 0.2;
// Accelerations above so many times gravity are smoothed, by this share of its own of each in a round.
constexpr double calm_share = 2, own_share = 0.25;
// Share of A d that single precision may lose.
constexpr double rounding_share = 1e-6;

}  // namespace

void ImplicitSolver::linearise(const Job& job) {
    elastic_.take_state(job.neighbourhoods, job.material,
                        {job.phyxels.rest_position, base_, job.phyxels.rotation, job.phyxels.plastic_strain},
                        job.parallel);
    exact_is_taken_ = false;
    right_side(job);
}

// Whether the solve has torn a neighbourhood that was whole where it began: one that it
// turns by far in a step grows, since it is turned along straight lines.
bool ImplicitSolver::is_torn(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    const std::size_t n = phyxels.size();
    solution_is_taken_ = false;
    const double far = sum_(job.parallel, n, [&](std::size_t begin, std::size_t end) {
        double count = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const double reach = far_share * phyxels.support_radius[i];
            count += d_[i].squaredNorm() > reach * reach;
        }
        return count;
    });
    if (far == 0) return false;
    for_phyxels(job.parallel, n, [&](std::size_t i) { p_[i] = base_[i] + d_[i]; });
    whole_.resize(n);
    for (std::size_t i = 0; i < n; ++i) whole_[i] = !elastic_.is_distorted(i);
    elastic_.take_state(job.neighbourhoods, job.material,
                        {phyxels.rest_position, p_, phyxels.rotation, phyxels.plastic_strain}, job.parallel);
    for (std::size_t i = 0; i < n; ++i)
        if (whole_[i] != 0 && elastic_.is_distorted(i)) return true;
    solution_is_taken_ = true;
    return false;
}

void ImplicitSolver::size_buffers(std::size_t count) {
    for (auto* array : {&b_, &diagonal_, &mobility_, &inverse_}) array->resize(count);
    for (auto* array : {&predicted_, &predicted_velocity_, &base_, &start_position_, &start_velocity_,
                        &right_, &pushed_, &d_, &r_, &p_, &q_})
        array->resize(count);
    failed_.assign(count, 0);
    for (auto* array : {&inverted_, &held_, &high_acceleration_}) array->resize(count);
    to_smooth_.reserve(count);
}

// What the choice of steps and the guess depend on.
void ImplicitSolver::choose_steps(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    supported_.assign(static_cast<std::size_t>(job.input.piece_count) + 1, 0);
    any_inverted_ =
        sum_(job.parallel, phyxels.size(), [&](std::size_t begin, std::size_t end) {
            double count = 0;
            for (std::size_t i = begin; i < end; ++i) {
                inverted_[i] = !(phyxels.deformation[i].determinant() > 0);
                held_[i] = !job.input.held.empty() && job.input.held[i] != 0;
                pushed_[i].setZero();
                count += inverted_[i];
                if ((held_[i] | phyxels.touching[i]) != 0)
                    std::atomic_ref(supported_[piece_of(job, i)]).store(1, std::memory_order_relaxed);
            }
            return count;
        }) > 0;
}

// Whether the phyxel steps by BDF2 or by backward Euler.
void ImplicitSolver::choose_step(const Job& job, std::size_t i) {
    const Phyxels& phyxels = job.phyxels;
    const bool history = job.options.bdf2 && phyxels.history_step == job.input.dt;
    const std::span<const std::uint32_t> offsets = job.neighbourhoods.offsets();
    bool beside_inverted = inverted_[i] != 0;
    for (std::uint32_t l = offsets[i]; any_inverted_ && l < offsets[i + 1] && history && !beside_inverted;
         ++l)
        beside_inverted =
            inverted_[job.neighbourhoods.neighbour()[l]] != 0 && job.neighbourhoods.weight()[l] > 0;
    const bool two_steps = history && phyxels.history_broken[i] == 0 && held_[i] == 0 && !beside_inverted &&
                           hit_[piece_of(job, i)] == 0;
    b_[i] = two_steps ? 2 * job.input.dt / 3 : job.input.dt;
}

// Where the phyxel would be without elastic force; gravity included, so that in
// free fall nothing is left to solve.
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

// All that a step reads of a phyxel's motion, in one loop: it is more than the caches hold.
void ImplicitSolver::predict(const Job& job) {
    for_phyxels(job.parallel, job.phyxels.size(), [&](std::size_t i) {
        choose_step(job, i);
        predict_phyxel(job, i);
        guess_acceleration(job, i);
    });
}

// -dE/dx and the dampings at the base, less what inertia says against the
// distance from prediction to base.
void ImplicitSolver::right_side(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    const double damping = job.material.stiffness_damping;
    const float* const found = elastic_.forces(job.parallel);
    const auto force_of = [&](std::size_t i) -> Vec3 {
        const std::size_t n = elastic_.stride();
        return Vec3f(found[i], found[n + i], found[2 * n + i]).cast<double>();
    };
    if (damping > 0) {
        for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) { right_[i] = force_of(i); });
        for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
            p_[i] = predicted_velocity_[i] + (base_[i] - predicted_[i]) / b_[i];
            mobility_[i] = 0;
        });
        elastic_.apply_stiffness(damping, mobility_, p_, q_, job.parallel);
    }
    for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
        if (!(damping > 0)) right_[i] = force_of(i);
        right_[i] -= diagonal_[i] * (base_[i] - predicted_[i]);
        right_[i] -= job.material.mass_damping * phyxels.mass[i] * predicted_velocity_[i];
        if (damping > 0) right_[i] -= q_[i];
        if (!right_[i].allFinite()) {
            right_[i].setZero();
            failed_[i] = 1;
        }
        const double all =
            diagonal_[i] + (1 + damping_ratio(job)) * job.neighbourhoods.stiffness_diagonal()[i];
        mobility_[i] = all > 0 ? 1 / all : 0;
    });
}

// Into p_, less gravity: the last step's, if it goes on.
void ImplicitSolver::guess_acceleration(const Job& job, std::size_t i) {
    const Phyxels& phyxels = job.phyxels;
    const bool known = phyxels.history_step == job.input.dt;
    const bool supported = supported_[piece_of(job, i)] != 0;
    p_[i].setZero();
    high_acceleration_[i] = 0;
    if (!job.options.warm_start || !(known || supported)) return;
    Vec3 acceleration = (phyxels.velocity[i] - phyxels.previous_velocity[i]) / job.input.dt;
    // A hit's jump of velocity is no acceleration that goes on.
    if (!known || phyxels.history_broken[i] != 0)
        acceleration = supported ? Vec3(Vec3::Zero()) : job.input.gravity;
    const Vec3 beyond = acceleration - job.input.gravity;
    if (!beyond.allFinite()) return;
    p_[i] = beyond;
    high_acceleration_[i] = supported && has_high_acceleration(job, beyond);
}

// The correction that would keep the last step's acceleration: where a body
// hangs, rests or turns it is the solution. Of a piece that is held or stands the solve begins there, and is
// linearised there: the prediction lets it fall past what holds it, b^2 g, which shears what lies beside by
// so much that a solve linearised there ends elsewhere, and elsewhere for each b.
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

bool ImplicitSolver::has_high_acceleration(const Job& job, const Vec3& beyond_gravity) {
    const double calm = calm_share * job.input.gravity.norm();
    return beyond_gravity.squaredNorm() > calm * calm;
}

// p_, accelerations less gravity, twice smoothed: of pieces that are linearised there, large ones are taken
// as the mean over what lies around. What a cut sets free springs back by hundreds of m/s^2 in one step and
// by as much the other way in the next; linearised where that would go on, it would be torn from its
// neighbours.
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
        return weight > 0 ? Vec3(own_share * p_[i] + (1 - own_share) / weight * sum) : p_[i];
    };
    for (int round = 0; round < 2; ++round) {
        for_phyxels(job.parallel, to_smooth_.size(), [&](std::size_t k) {
            const std::size_t i = to_smooth_[k];
            q_[k] = has_high_acceleration(job, p_[i]) ? mean_around(i) : p_[i];
        });
        for_phyxels(job.parallel, to_smooth_.size(), [&](std::size_t k) { p_[to_smooth_[k]] = q_[k]; });
    }
}

// The part of a force that a phyxel is free to follow.
Vec3 ImplicitSolver::filtered(std::size_t i, const Vec3& force) const {
    return held_[i] != 0 ? Vec3(Vec3::Zero()) : force;
}

double ImplicitSolver::damping_ratio(const Job& job) const {
    const double b = job.options.bdf2 ? 2 * job.input.dt / 3 : job.input.dt;
    return job.material.stiffness_damping / b;
}

// The square of the residual, in the norm of the inverse diagonal, that ends a solve: the
// tolerance's share of the right side, but no more than ten times that share of the
// forces that gravity and the last step's acceleration stand for. The right side
// grows with stiffness where a body that is held or stands was predicted to fall;
// measured by it alone a stiff body would not feel its weight. Where the solve begins at
// a guess the right side is what that is wrong by; what it bears counts too.
double ImplicitSolver::wanted_residual(const Job& job, double tolerance) {
    const Phyxels& phyxels = job.phyxels;
    const auto chunk = [&](std::size_t begin, std::size_t end) {
        WantedSums sums;
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3 borne = filtered(i, diagonal_[i] * (base_[i] - predicted_[i]));
            sums.right += inverse_[i] * filtered(i, right_[i] + pushed_[i]).squaredNorm();
            sums.borne += inverse_[i] * borne.squaredNorm();
            const Vec3 acceleration = (start_velocity_[i] - phyxels.previous_velocity[i]) / job.input.dt;
            const double force = phyxels.mass[i] * (acceleration.norm() + job.input.gravity.norm());
            sums.felt += inverse_[i] * force * force;
            const double correction = smallest_correction * phyxels.support_radius[i];
            sums.least += inverse_[i] > 0 ? correction * correction / inverse_[i] : 0;
        }
        return sums;
    };
    const WantedSums sums = wanted_sum_(job.parallel, phyxels.size(), phyxel_grain, chunk);
    const double right = std::max(sums.right, 100 * sums.borne);
    const double scale = sums.felt > 0 ? std::min(right, 100 * sums.felt) : right;
    return std::max(tolerance * tolerance * scale, sums.least);
}

// Whether d_ is zero.
bool ImplicitSolver::is_at_base(const Job& job) {
    return sum_(job.parallel, d_.size(), [&](std::size_t begin, std::size_t end) {
               double count = 0;
               for (std::size_t i = begin; i < end; ++i) count += !d_[i].isZero(0);
               return count;
           }) == 0;
}

// q_ = A d_, less the contacts' part.
void ImplicitSolver::stiffness_times_solution(const Job& job, bool exact) {
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
}

// In the norm of the inverse diagonal.
double ImplicitSolver::square_of(const Job& job, std::span<const Vec3> of) {
    return sum_(job.parallel, of.size(), [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += inverse_[i] * of[i].squaredNorm();
        return sum;
    });
}

// Of d_ = 0.
double ImplicitSolver::residual_at_base(const Job& job) {
    return sum_(job.parallel, r_.size(), [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) {
            r_[i] = filtered(i, right_[i] + pushed_[i]);
            sum += inverse_[i] * r_[i].squaredNorm();
        }
        return sum;
    });
}

// From q_ = A d_.
double ImplicitSolver::residual_from_product(const Job& job, bool exact, double& noise) {
    noise = exact ? 0 : rounding_share * rounding_share * square_of(job, q_);
    for_phyxels(job.parallel, q_.size(),
                [&](std::size_t i) { r_[i] = filtered(i, right_[i] + pushed_[i] - q_[i]); });
    return square_of(job, r_);
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
        if (held_[i] != 0) constrained_.push_back(static_cast<std::uint32_t>(i));
    for_phyxels(job.parallel, n, [&](std::size_t i) {
        fine_diagonal_[i] = static_cast<float>(diagonal_[i]);
        fine_inverse_[i] = static_cast<float>(inverse_[i]);
        for (std::size_t k = 0; k < 3; ++k) {
            fine_r_[k * stride + i] = static_cast<float>(r_[i][static_cast<int>(k)]);
            fine_d_[k * stride + i] = 0;
        }
    });
}

// Takes off fine_q_ what held phyxels cannot follow.
void ImplicitSolver::filter() {
    const std::size_t stride = elastic_.stride();
    for (const std::uint32_t i : constrained_)
        for (std::size_t k = 0; k < 3; ++k) fine_q_[k * stride + i] = 0;
}

// The preconditioner's coarse part.
void ImplicitSolver::weigh_aggregates(const Job& job) {
    aggregates_.update(job.phyxels, job.neighbourhoods, held_, job.parallel);
    aggregates_.weigh(job.neighbourhoods, 1 + damping_ratio(job), diagonal_, added_, job.parallel);
}

// Adds what a descent found to the solution; r_ is what it left.
void ImplicitSolver::add_found(const Job& job) {
    const std::size_t stride = elastic_.stride();
    for_phyxels(job.parallel, job.phyxels.size(), [&](std::size_t i) {
        for (std::size_t k = 0; k < 3; ++k) {
            d_[i][static_cast<int>(k)] += static_cast<double>(fine_d_[k * stride + i]);
            r_[i][static_cast<int>(k)] = static_cast<double>(fine_r_[k * stride + i]);
        }
    });
}

// New position, velocity and history of one phyxel.
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
    // A hit is no history to go on from: its jump of velocity would be carried on.
    phyxels.history_broken[i] = held_[i] != 0 || failed_[i] != 0 || hit_[piece_of(job, i)] != 0;
}

// The phyxel's piece; piece_count for those outside the range.
std::size_t ImplicitSolver::piece_of(const Job& job, std::size_t i) const {
    const std::int32_t piece = job.phyxels.piece[i];
    return static_cast<std::size_t>(piece >= 0 && piece < job.input.piece_count ? piece
                                                                                : job.input.piece_count);
}

}  // namespace splitcubes::meshless
