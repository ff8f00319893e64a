#include <splitcubes/dynamics/implicit/implicit_solver.h>
#include <splitcubes/dynamics/tuning.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

namespace splitcubes::meshless {

void ImplicitSolver::linearise(const Job& job) {
    elastic_.take_state(
        job.neighbourhoods, job.material,
        {job.phyxels.rest_position, system_.base, job.phyxels.rotation, job.phyxels.plastic_strain},
        job.parallel);
    elastic_.take_twists(
        {job.phyxels.deformation, job.phyxels.rotation, job.phyxels.piece, conditions_.restrained},
        job.parallel);
    exact_.is_linearised = false;
    compute_rhs(job);
}

// Returns whether the solve distorted a neighbourhood that was undistorted where it began: a neighbourhood
// that rotates far in one step grows, since the linearised motion runs along straight lines.
bool ImplicitSolver::has_new_distortion(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    const std::size_t n = phyxels.size();
    relinearisation_.has_solution_state = false;
    const double far_count = sum_(job.parallel, n, [&](std::size_t begin, std::size_t end) {
        double count = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const double limit = tuning::guess::distortion_check_share * phyxels.support_radius[i];
            count += vectors_.d[i].squaredNorm() > limit * limit;
        }
        return count;
    });
    if (far_count == 0) return false;
    for_phyxels(job.parallel, n, [&](std::size_t i) { vectors_.p[i] = system_.base[i] + vectors_.d[i]; });
    relinearisation_.undistorted.resize(n);
    for (std::size_t i = 0; i < n; ++i) relinearisation_.undistorted[i] = !elastic_.is_distorted(i);
    elastic_.take_state(job.neighbourhoods, job.material,
                        {phyxels.rest_position, vectors_.p, phyxels.rotation, phyxels.plastic_strain},
                        job.parallel);
    for (std::size_t i = 0; i < n; ++i)
        if (relinearisation_.undistorted[i] != 0 && elastic_.is_distorted(i)) return true;
    relinearisation_.has_solution_state = true;
    return false;
}

void ImplicitSolver::size_buffers(std::size_t count) {
    for (auto* array : {&system_.b, &system_.diagonal, &system_.mobility, &system_.inverse})
        array->resize(count);
    for (auto* array : {&prediction_.position, &prediction_.velocity, &system_.base,
                        &prediction_.start_position, &prediction_.start_velocity, &system_.rhs,
                        &springs_.force, &vectors_.d, &vectors_.r, &vectors_.p, &vectors_.q})
        array->resize(count);
    conditions_.failed.assign(count, 0);
    for (auto* array :
         {&conditions_.inverted, &conditions_.held, &conditions_.skipped, &smoothing_.high_acceleration})
        array->resize(count);
    smoothing_.phyxels.reserve(count);
}

// Determines what the choice of step sizes and the initial guess depend on.
void ImplicitSolver::find_step_conditions(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    conditions_.is_turned = false;
    conditions_.supported.assign(static_cast<std::size_t>(job.input.piece_count) + 1, 0);
    conditions_.any_inverted = sum_(job.parallel, phyxels.size(), [&](std::size_t begin, std::size_t end) {
                                   double count = 0;
                                   for (std::size_t i = begin; i < end; ++i) {
                                       conditions_.inverted[i] = !(phyxels.deformation[i].determinant() > 0);
                                       conditions_.held[i] =
                                           !job.input.held.empty() && job.input.held[i] != 0;
                                       springs_.force[i].setZero();
                                       count += conditions_.inverted[i];
                                       if ((conditions_.held[i] | phyxels.touching[i]) != 0)
                                           std::atomic_ref(conditions_.supported[piece_of(job, i)])
                                               .store(1, std::memory_order_relaxed);
                                   }
                                   return count;
                               }) > 0;
}

// Marks the pieces that turn so far in the step that BDF2, which extrapolates along chords, would take the
// rest of the rotation for strain.
void ImplicitSolver::mark_far_turns(const Job& job) {
    conditions_.turns_far.assign(static_cast<std::size_t>(job.input.piece_count) + 1, 0);
    const double max_rate = tuning::stages::max_rotation / job.input.dt;
    if (!(momenta_.largest_rate() > max_rate)) return;
    for (std::size_t k = 0; k + 1 < conditions_.turns_far.size(); ++k)
        conditions_.turns_far[k] = momenta_.rate(k) > max_rate;
    for (std::size_t i = 0; i < job.phyxels.size(); ++i)
        if (conditions_.held[i] != 0) conditions_.turns_far[piece_of(job, i)] = 0;
}

// Returns whether the last step can serve as history. BDF2 by itself takes equal steps only.
bool ImplicitSolver::has_history(const Job& job) {
    if (job.options.stage != TimeStage::none) return job.phyxels.history_step > 0;
    return job.phyxels.history_step == job.input.dt;
}

// Returns the divisor of the change over the last step that BDF2 adds: (1 + 2 r) / r^2 for a ratio r of the
// steps.
double ImplicitSolver::history_divisor(const Job& job) {
    if (job.options.stage != TimeStage::second) return 3;
    const double ratio = job.input.dt / job.phyxels.history_step;
    return (1 + 2 * ratio) / (ratio * ratio);
}

// Returns the effective time step of phyxels that take a step of second order: (1 + r) / (1 + 2 r) of the
// step for BDF2 (Hairer and Wanner 1996, section V.1), half of it for the trapezoidal rule.
double ImplicitSolver::second_order_step(const Job& job) {
    const double dt = job.input.dt;
    if (job.options.stage == TimeStage::trapezoidal) return 0.5 * dt;
    if (job.options.stage == TimeStage::none) return 2 * dt / 3;
    const double ratio = dt / job.phyxels.history_step;
    return (1 + ratio) / (1 + 2 * ratio) * dt;
}

// Chooses a scheme of second order or backward Euler for a phyxel.
void ImplicitSolver::choose_step_size(const Job& job, std::size_t i) {
    const Phyxels& phyxels = job.phyxels;
    const bool is_trapezoidal = job.options.stage == TimeStage::trapezoidal;
    const bool can_be_second_order =
        is_trapezoidal || (job.options.scheme != TimeScheme::backward_euler && has_history(job));
    bool beside_inverted = conditions_.inverted[i] != 0;
    for (std::uint32_t l = job.neighbourhoods.links_begin(i);
         conditions_.any_inverted && l < job.neighbourhoods.links_end(i) && can_be_second_order &&
         !beside_inverted;
         ++l)
        beside_inverted = conditions_.inverted[job.neighbourhoods.neighbour()[l]] != 0 &&
                          job.neighbourhoods.weight()[l] > 0;
    const bool is_second_order = can_be_second_order && (is_trapezoidal || phyxels.restart_history[i] == 0) &&
                                 conditions_.held[i] == 0 && !beside_inverted &&
                                 conditions_.hit[piece_of(job, i)] == 0 &&
                                 conditions_.turns_far[piece_of(job, i)] == 0;
    system_.b[i] = is_second_order ? second_order_step(job) : job.input.dt;
}

// Predicts a phyxel without elastic force. Gravity is included, so that nothing is left to solve in free
// fall.
void ImplicitSolver::predict_phyxel(const Job& job, std::size_t i) {
    const Phyxels& phyxels = job.phyxels;
    const double dt = job.input.dt;
    const Vec3& x = phyxels.position[i];
    const Vec3& v = phyxels.velocity[i];
    const double b = system_.b[i];
    const bool is_second_order = b < dt;
    const bool is_trapezoidal = is_second_order && job.options.stage == TimeStage::trapezoidal;
    prediction_.start_position[i] = x;
    prediction_.start_velocity[i] = v;
    Vec3 without_start = Vec3::Zero();  // m: the prediction without the acceleration before the step
    if (is_trapezoidal) {
        // x1 = x + b (v + v1), v1 = v + b (a + a1), b half the step.
        const Vec3& a = prediction_.start_acceleration[i];
        prediction_.velocity[i] = v + b * (a + 2 * job.input.gravity);
        prediction_.position[i] = x + b * (v + prediction_.velocity[i]);
        without_start = b * b * a;
    } else {
        // BDF2, for equal steps 4/3 a - 1/3 a', written as a + (a - a')/3: exact where nothing moves.
        const double divisor = history_divisor(job);
        const Vec3 old_x = is_second_order ? Vec3(x + (x - phyxels.previous_position[i]) / divisor) : x;
        const Vec3 old_v = is_second_order ? Vec3(v + (v - phyxels.previous_velocity[i]) / divisor) : v;
        prediction_.velocity[i] = old_v + b * job.input.gravity;
        prediction_.position[i] = old_x + b * prediction_.velocity[i];
    }
    if (conditions_.held[i] != 0) {
        prediction_.position[i] = job.input.held_position[i];
        prediction_.velocity[i] = (prediction_.position[i] - x) / dt;
    }
    if (!prediction_.position[i].allFinite() || !prediction_.velocity[i].allFinite()) {
        conditions_.failed[i] = 1;
        prediction_.velocity[i].setZero();
        prediction_.position[i] = x.allFinite() ? x : phyxels.previous_position[i];
    }
    system_.base[i] = prediction_.position[i] - without_start;
    const double m = phyxels.mass[i];
    system_.diagonal[i] = (1 + b * job.material.mass_damping) * m / (b * b);
}

// Computes the accelerations by elastic and damping forces at the start of a trapezoidal stage.
void ImplicitSolver::find_start_accelerations(const Job& job) {
    const Phyxels& phyxels = job.phyxels;
    const double damping = job.material.stiffness_damping;
    std::vector<Vec3>& acceleration = prediction_.start_acceleration;
    acceleration.resize(phyxels.size());
    elastic_.take_state(job.neighbourhoods, job.material, configuration_of(phyxels), job.parallel);
    const float* const found = elastic_.forces(job.parallel);
    const std::size_t n = elastic_.stride();
    for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
        acceleration[i] = Vec3f(found[i], found[n + i], found[2 * n + i]).cast<double>();
        vectors_.q[i].setZero();
        system_.mobility[i] = 0;
    });
    if (damping > 0) {
        elastic_.take_twists({phyxels.deformation, phyxels.rotation, phyxels.piece, conditions_.restrained},
                             job.parallel);
        elastic_.apply_stiffness(damping, system_.mobility, phyxels.velocity, vectors_.q, job.parallel, 0);
    }
    for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
        const double m = phyxels.mass[i];
        acceleration[i] =
            (acceleration[i] - vectors_.q[i]) / m - job.material.mass_damping * phyxels.velocity[i];
        if (!(m > 0) || !acceleration[i].allFinite()) acceleration[i].setZero();
    });
}

// One loop over everything that is read of the motion: the arrays exceed the caches.
void ImplicitSolver::predict(const Job& job) {
    if (job.options.stage == TimeStage::trapezoidal) find_start_accelerations(job);
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
        for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) { system_.rhs[i] = force_of(i); });
        for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
            vectors_.p[i] =
                prediction_.velocity[i] + (system_.base[i] - prediction_.position[i]) / system_.b[i];
            vectors_.q[i] = system_.base[i] - prediction_.start_position[i];
            system_.mobility[i] = 0;
        });
        // Chords of a rotation are no strain rate.
        if (conditions_.is_turned) {
            rotations_.keep_strain(job.phyxels, job.input.piece_count, conditions_.held,
                                   prediction_.start_position, vectors_.q, job.parallel);
            for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
                if (!(system_.b[i] < job.input.dt)) vectors_.p[i] = vectors_.q[i] / job.input.dt;
            });
        }
        // A twist would damp the rotation of a taut body.
        elastic_.apply_stiffness(damping, system_.mobility, vectors_.p, vectors_.q, job.parallel, 0);
    }
    for_phyxels(job.parallel, phyxels.size(), [&](std::size_t i) {
        if (!(damping > 0)) system_.rhs[i] = force_of(i);
        system_.rhs[i] -= system_.diagonal[i] * (system_.base[i] - prediction_.position[i]);
        system_.rhs[i] -= job.material.mass_damping * phyxels.mass[i] * prediction_.velocity[i];
        if (damping > 0) system_.rhs[i] -= vectors_.q[i];
        if (!system_.rhs[i].allFinite()) {
            system_.rhs[i].setZero();
            conditions_.failed[i] = 1;
        }
        const double total =
            system_.diagonal[i] + (1 + damping_ratio(job)) * job.neighbourhoods.stiffness_diagonal()[i];
        system_.mobility[i] = total > 0 ? 1 / total : 0;
    });
}

// Writes the acceleration minus gravity of the last step to p, or a substitute if that does not continue.
void ImplicitSolver::guess_acceleration(const Job& job, std::size_t i) {
    const Phyxels& phyxels = job.phyxels;
    const bool is_continued = has_history(job);
    const bool supported = conditions_.supported[piece_of(job, i)] != 0;
    vectors_.p[i].setZero();
    smoothing_.high_acceleration[i] = 0;
    if (!job.options.warm_start || !(is_continued || supported)) return;
    if (conditions_.turns_far[piece_of(job, i)] != 0) return;
    const double last_step = is_continued ? phyxels.history_step : job.input.dt;
    Vec3 acceleration = (phyxels.velocity[i] - phyxels.previous_velocity[i]) / last_step;
    // The velocity jump of an impact does not continue as an acceleration.
    if (!is_continued || phyxels.restart_history[i] != 0)
        acceleration = supported ? Vec3(Vec3::Zero()) : job.input.gravity;
    const Vec3 less_gravity = acceleration - job.input.gravity;
    if (!less_gravity.allFinite()) return;
    vectors_.p[i] = less_gravity;
    smoothing_.high_acceleration[i] = supported && has_high_acceleration(job, less_gravity);
}

// Starts from the correction that keeps the last step's acceleration: it is the solution for a body that
// hangs, rests or rotates steadily. For a piece that is held or supported it becomes the point of
// linearisation. The prediction would let such a piece fall past its support by b^2 g and shear the adjacent
// phyxels so much that a solve linearised there ends elsewhere, and elsewhere for each b.
void ImplicitSolver::start_guess(const Job& job) {
    if (momenta_.largest_rate() * job.input.dt > tuning::guess::min_rotation) turn_prediction(job);
    smooth_high_accelerations(job);
    // The base of a trapezoidal stage lacks the acceleration at both ends.
    const double ends = job.options.stage == TimeStage::trapezoidal ? 2 : 1;
    for_phyxels(job.parallel, job.phyxels.size(), [&](std::size_t i) {
        vectors_.d[i].setZero();
        if (conditions_.held[i] != 0) return;
        const double b = system_.b[i];
        const double square = (b < job.input.dt ? ends : 1) * b * b;
        if (conditions_.supported[piece_of(job, i)] != 0)
            system_.base[i] += square * vectors_.p[i];
        else
            vectors_.d[i] = square * vectors_.p[i];
    });
    follow_holds(job);
}

// Moves the guess of held pieces along with their holds, whose acceleration need not go on as it was. The
// gaps that would open at the edge of a hold are closed by a common displacement, as far as the links there
// are stiffer than the inertia of the piece, and as the accelerations of the hold explain it. A solve from
// strained links ends with a part of that strain.
void ImplicitSolver::follow_holds(const Job& job) {
    prediction_.gaps.clear();
    if (job.input.held.empty()) return;
    prediction_.gaps.assign(conditions_.supported.size(), {});
    for (std::size_t i = 0; i < job.phyxels.size(); ++i) {
        HoldGap& gap = prediction_.gaps[piece_of(job, i)];
        if (conditions_.held[i] == 0)
            gap.inertia += system_.diagonal[i];
        else
            add_gap(job, i, gap);
    }
    for_phyxels(job.parallel, job.phyxels.size(), [&](std::size_t i) {
        const HoldGap& gap = prediction_.gaps[piece_of(job, i)];
        if (conditions_.held[i] != 0 || !(gap.stiffness > 0) || !(gap.change > 0)) return;
        const Vec3 shift = gap.force / (gap.stiffness + gap.inertia);
        system_.base[i] += gap.change / std::max(gap.change, shift.norm()) * shift;
    });
}

// Returns whether a hold jerks a body whose tangent is not the derivative of its forces. One linearisation
// then leaves spurious strain: the solve's tolerance is relative to the forces of the guess, which are far
// larger than those due.
bool ImplicitSolver::is_jerked(const Job& job) const {
    if (is_frame_sufficient(job.material) || job.phyxels.size() == 0) return false;
    const double limit = tuning::guess::jerk_share * job.phyxels.support_radius.front();
    return std::any_of(prediction_.gaps.begin(), prediction_.gaps.end(),
                       [&](const HoldGap& gap) { return gap.stiffness > 0 && gap.change > limit; });
}

// Adds the gaps between a held phyxel and its free neighbours.
void ImplicitSolver::add_gap(const Job& job, std::size_t i, HoldGap& gap) const {
    const auto displacement = [&](std::size_t k) -> Vec3 {
        return system_.base[k] - prediction_.start_position[k];
    };
    const Vec3 &speed = job.phyxels.velocity[i], &last_speed = job.phyxels.previous_velocity[i];
    const double dt = job.input.dt;
    const double change = (displacement(i) - dt * speed).norm() + dt * (speed - last_speed).norm();
    gap.change = std::max(gap.change, change);
    const Neighbourhoods& links = job.neighbourhoods;
    for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l) {
        const std::uint32_t j = links.neighbour()[l];
        if (conditions_.held[j] != 0) continue;
        const double stiffness = links.link_coupling(l, i);
        gap.force += stiffness * (displacement(i) - displacement(j));
        gap.stiffness += stiffness;
    }
}

// Takes the growth along chords out of the velocities of pieces that took backward Euler.
void ImplicitSolver::straighten_velocities(const Job& job) {
    for_phyxels(job.parallel, vectors_.q.size(), [&](std::size_t i) {
        vectors_.q[i] = job.phyxels.position[i] - prediction_.start_position[i];
        conditions_.skipped[i] =
            system_.b[i] < job.input.dt || conditions_.held[i] != 0 || conditions_.failed[i] != 0;
    });
    rotations_.keep_strain(job.phyxels, job.input.piece_count, conditions_.skipped,
                           prediction_.start_position, vectors_.q, job.parallel);
    rotations_.straighten(job.phyxels, job.input.piece_count, conditions_.skipped, vectors_.q, job.input.dt,
                          job.parallel);
}

// Carries out the rotations of pieces in the prediction as finite ones. These have the centripetal
// acceleration within them, so the guess loses it.
void ImplicitSolver::turn_prediction(const Job& job) {
    conditions_.is_turned = true;
    for_phyxels(job.parallel, vectors_.q.size(),
                [&](std::size_t i) { vectors_.q[i] = system_.base[i] - prediction_.start_position[i]; });
    rotations_.apply(job.phyxels, job.material, job.input.piece_count, conditions_.held,
                     prediction_.start_position, vectors_.q, job.parallel);
    for_phyxels(job.parallel, vectors_.q.size(), [&](std::size_t i) {
        if (conditions_.held[i] != 0) return;
        system_.base[i] = prediction_.start_position[i] + vectors_.q[i];
        if (!vectors_.p[i].isZero(0) && job.phyxels.restart_history[i] == 0)
            vectors_.p[i] -= rotations_.centripetal(job.phyxels.piece[i], prediction_.start_position[i]) /
                             (job.input.dt * job.input.dt);
    });
}

bool ImplicitSolver::has_high_acceleration(const Job& job, const Vec3& acceleration_less_gravity) {
    const double threshold = tuning::guess::smoothing_threshold * job.input.gravity.norm();
    return acceleration_less_gravity.squaredNorm() > threshold * threshold;
}

// Smooths p, the accelerations minus gravity, in two passes: high accelerations of pieces that are
// linearised at the guess are averaged with their neighbours. Material freed by a cut springs back at
// hundreds of m/s^2 in one step and as much the other way in the next; linearised at a continuation of that,
// it would be torn from its neighbours.
void ImplicitSolver::smooth_high_accelerations(const Job& job) {
    const Neighbourhoods& links = job.neighbourhoods;
    smoothing_.phyxels.clear();
    for (std::uint32_t i = 0; i < smoothing_.high_acceleration.size(); ++i)
        if (smoothing_.high_acceleration[i] != 0) smoothing_.phyxels.push_back(i);
    const auto mean_around = [&](std::size_t i) {
        Vec3 sum = Vec3::Zero();
        double weight = 0;
        for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l) {
            sum += links.weight()[l] * vectors_.p[links.neighbour()[l]];
            weight += links.weight()[l];
        }
        return weight > 0 ? Vec3(tuning::guess::smoothing_own_weight * vectors_.p[i] +
                                 (1 - tuning::guess::smoothing_own_weight) / weight * sum)
                          : vectors_.p[i];
    };
    for (int pass = 0; pass < 2; ++pass) {
        for_phyxels(job.parallel, smoothing_.phyxels.size(), [&](std::size_t k) {
            const std::size_t i = smoothing_.phyxels[k];
            vectors_.q[k] = has_high_acceleration(job, vectors_.p[i]) ? mean_around(i) : vectors_.p[i];
        });
        for_phyxels(job.parallel, smoothing_.phyxels.size(),
                    [&](std::size_t k) { vectors_.p[smoothing_.phyxels[k]] = vectors_.q[k]; });
    }
}

// Returns the force if the phyxel is free, zero if it is held.
Vec3 ImplicitSolver::filtered(std::size_t i, const Vec3& force) const {
    return conditions_.held[i] != 0 ? Vec3(Vec3::Zero()) : force;
}

double ImplicitSolver::damping_ratio(const Job& job) const {
    const bool is_first_order =
        job.options.stage == TimeStage::none && job.options.scheme == TimeScheme::backward_euler;
    return job.material.stiffness_damping / (is_first_order ? job.input.dt : second_order_step(job));
}

// Returns the squared residual, in the norm of the inverse diagonal, that ends a solve: the tolerance's share
// of the right side, but at most ten times that share of the forces of gravity and of the last step's
// acceleration. The right side grows with stiffness when a held or supported body was predicted to fall; by
// that measure alone a stiff body would ignore its weight. When the solve begins at a guess, the right side
// is only the error of the guess, so the inertia forces of the base count as well.
double ImplicitSolver::wanted_residual(const Job& job, double tolerance) {
    const Phyxels& phyxels = job.phyxels;
    const double last_step = has_history(job) ? phyxels.history_step : job.input.dt;
    const auto chunk = [&](std::size_t begin, std::size_t end) {
        ToleranceSums sums;
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3 base_force =
                filtered(i, system_.diagonal[i] * (system_.base[i] - prediction_.position[i]));
            sums.right += system_.inverse[i] * filtered(i, system_.rhs[i] + springs_.force[i]).squaredNorm();
            sums.base += system_.inverse[i] * base_force.squaredNorm();
            const Vec3 acceleration =
                (prediction_.start_velocity[i] - phyxels.previous_velocity[i]) / last_step;
            const double force = phyxels.mass[i] * (acceleration.norm() + job.input.gravity.norm());
            sums.inertial += system_.inverse[i] * force * force;
            const double correction = tuning::solve::smallest_correction * phyxels.support_radius[i];
            sums.rounding += system_.inverse[i] > 0 ? correction * correction / system_.inverse[i] : 0;
        }
        return sums;
    };
    const ToleranceSums sums = wanted_sum_(job.parallel, phyxels.size(), phyxel_grain, chunk);
    const double right = std::max(sums.right, 100 * sums.base);
    const double scale = sums.inertial > 0 ? std::min(right, 100 * sums.inertial) : right;
    return std::max(tolerance * tolerance * scale, sums.rounding);
}

// Returns whether d is zero.
bool ImplicitSolver::is_at_base(const Job& job) {
    return sum_(job.parallel, vectors_.d.size(), [&](std::size_t begin, std::size_t end) {
               double count = 0;
               for (std::size_t i = begin; i < end; ++i) count += !vectors_.d[i].isZero(0);
               return count;
           }) == 0;
}

// Computes q = A d without the contacts.
void ImplicitSolver::stiffness_times_solution(const Job& job, bool exact) {
    const std::size_t n = job.phyxels.size();
    const double factor = 1 + damping_ratio(job);
    if (exact && !exact_.is_linearised) {
        exact_.deformation.resize(n);
        exact_.rotation.resize(n);
        compute_deformation(job.neighbourhoods, job.phyxels.rest_position, system_.base, job.phyxels.rotation,
                            exact_.deformation, exact_.rotation, job.parallel);
        exact_.forces.linearise(
            job.neighbourhoods, job.material,
            {system_.base, exact_.deformation, exact_.rotation, job.phyxels.plastic_strain}, job.parallel);
        for (std::size_t i = 0; i < n; ++i)
            exact_.forces.set_twist(i, elastic_.twist(i), elastic_.is_majorizer(i));
        exact_.is_linearised = true;
    }
    if (exact)
        exact_.forces.apply_stiffness(job.neighbourhoods, job.material, factor, system_.diagonal, vectors_.d,
                                      vectors_.q, job.parallel);
    else
        elastic_.apply_stiffness(factor, system_.diagonal, vectors_.d, vectors_.q, job.parallel);
}

// Returns the squared norm in the metric of the inverse diagonal.
double ImplicitSolver::squared_norm(const Job& job, std::span<const Vec3> of) {
    return sum_(job.parallel, of.size(), [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += system_.inverse[i] * of[i].squaredNorm();
        return sum;
    });
}

// Computes the residual for d = 0; returns its squared norm.
double ImplicitSolver::residual_at_base(const Job& job) {
    return sum_(job.parallel, vectors_.r.size(), [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) {
            vectors_.r[i] = filtered(i, system_.rhs[i] + springs_.force[i]);
            sum += system_.inverse[i] * vectors_.r[i].squaredNorm();
        }
        return sum;
    });
}

// Computes the residual from q = A d; returns its squared norm. noise: estimate of its rounding error.
double ImplicitSolver::residual_from_product(const Job& job, bool exact, double& noise) {
    noise =
        exact ? 0
              : tuning::solve::rounding_share * tuning::solve::rounding_share * squared_norm(job, vectors_.q);
    for_phyxels(job.parallel, vectors_.q.size(), [&](std::size_t i) {
        vectors_.r[i] = filtered(i, system_.rhs[i] + springs_.force[i] - vectors_.q[i]);
    });
    return squared_norm(job, vectors_.r);
}

void ImplicitSolver::load_residual(const Job& job) {
    const std::size_t n = job.phyxels.size(), stride = elastic_.stride();
    const auto size = [](FloatArray& array, std::size_t length) {
        if (array.size() != length) array.assign(length, 0);
    };
    for (FloatArray* array : {&cg_.d, &cg_.r, &cg_.p, &cg_.q}) size(*array, 3 * stride);
    for (FloatArray* array : {&cg_.diagonal, &cg_.inverse}) size(*array, stride);
    cg_.constrained.clear();
    for (std::size_t i = 0; i < n; ++i)
        if (conditions_.held[i] != 0) cg_.constrained.push_back(static_cast<std::uint32_t>(i));
    for_phyxels(job.parallel, n, [&](std::size_t i) {
        cg_.diagonal[i] = static_cast<float>(system_.diagonal[i]);
        cg_.inverse[i] = static_cast<float>(system_.inverse[i]);
        for (std::size_t k = 0; k < 3; ++k) {
            cg_.r[k * stride + i] = static_cast<float>(vectors_.r[i][static_cast<int>(k)]);
            cg_.d[k * stride + i] = 0;
        }
    });
}

// Zeroes the entries of held phyxels in cg_.q.
void ImplicitSolver::filter() {
    const std::size_t stride = elastic_.stride();
    for (const std::uint32_t i : cg_.constrained)
        for (std::size_t k = 0; k < 3; ++k) cg_.q[k * stride + i] = 0;
}

// Updates the coarse part of the preconditioner.
void ImplicitSolver::compute_aggregate_weights(const Job& job) {
    aggregates_.update(job.phyxels, job.neighbourhoods, conditions_.held, job.parallel);
    aggregates_.compute_weights(job.neighbourhoods, 1 + damping_ratio(job), system_.diagonal,
                                springs_.stiffness, job.parallel);
}

// Adds the correction that conjugate gradients found to d and stores their residual in r.
void ImplicitSolver::add_correction(const Job& job) {
    const std::size_t stride = elastic_.stride();
    for_phyxels(job.parallel, job.phyxels.size(), [&](std::size_t i) {
        for (std::size_t k = 0; k < 3; ++k) {
            vectors_.d[i][static_cast<int>(k)] += static_cast<double>(cg_.d[k * stride + i]);
            vectors_.r[i][static_cast<int>(k)] = static_cast<double>(cg_.r[k * stride + i]);
        }
    });
}

// Writes the new position, velocity and history of one phyxel.
void ImplicitSolver::finish_phyxel(const Job& job, std::size_t i) {
    Phyxels& phyxels = job.phyxels;
    Vec3 x = system_.base[i] + vectors_.d[i];
    Vec3 v = prediction_.velocity[i] + (x - prediction_.position[i]) / system_.b[i];
    if (!x.allFinite() || !v.allFinite()) conditions_.failed[i] = 1;
    if (conditions_.failed[i] != 0) {
        x = prediction_.position[i];
        v = prediction_.velocity[i];
    }
    phyxels.previous_position[i] = prediction_.start_position[i];
    phyxels.previous_velocity[i] = prediction_.start_velocity[i];
    phyxels.position[i] = x;
    phyxels.velocity[i] = v;
    // BDF2 would extrapolate the velocity jump of an impact.
    const std::size_t piece = piece_of(job, i);
    phyxels.restart_history[i] = conditions_.held[i] != 0 || conditions_.failed[i] != 0 ||
                                 conditions_.hit[piece] != 0 || conditions_.turns_far[piece] != 0;
}

// Returns the phyxel's piece, or piece_count if it is out of range.
std::size_t ImplicitSolver::piece_of(const Job& job, std::size_t i) const {
    const std::int32_t piece = job.phyxels.piece[i];
    return static_cast<std::size_t>(piece >= 0 && piece < job.input.piece_count ? piece
                                                                                : job.input.piece_count);
}

}  // namespace splitcubes::meshless
