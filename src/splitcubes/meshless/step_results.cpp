#include <splitcubes/core/error.h>
#include <splitcubes/meshless/step_results.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace splitcubes::meshless {

namespace {

void check_length(std::size_t length, std::size_t wanted, const char* name) {
    if (length == wanted) return;
    throw InputError(std::string("StepInput.") + name,
                     "has " + std::to_string(length) + " entries for " + std::to_string(wanted) + " phyxels",
                     "give one a phyxel");
}

}  // namespace

void check_step_input(const Phyxels& phyxels, const StepInput& input) {
    if (!(input.dt > 0) || !std::isfinite(input.dt))
        throw InputError("StepInput.dt", "is not positive (" + std::to_string(input.dt) + ")",
                         "give the step in seconds");
    if (input.held.empty()) return;
    check_length(input.held.size(), phyxels.size(), "held");
    check_length(input.held_position.size(), phyxels.size(), "held_position");
}

void MomentumKeeper::begin(const Phyxels& phyxels, int piece_count) {
    piece_momenta(phyxels, piece_count, before_);
    bound_.assign(static_cast<std::size_t>(piece_count) + 1, 0);
    bound_.back() = 1;
}

void MomentumKeeper::restore(Phyxels& phyxels, double kept, const Vec3& velocity,
                             std::span<const double> shift, double dt, const Parallel& parallel) {
    // By moving (the solver's error), then by velocities to rounding.
    if (!shift.empty()) correct(phyxels, kept, velocity, shift, 0, parallel);
    correct(phyxels, kept, velocity, {}, dt, parallel);
}

// dt 0: centres are left where they are.
void MomentumKeeper::correct(Phyxels& phyxels, double kept, const Vec3& velocity,
                             std::span<const double> shift, double dt, const Parallel& parallel) {
    piece_momenta(phyxels, static_cast<int>(before_.size()), after_);
    way_.assign(before_.size() + 1, Vec3::Zero());
    for (std::size_t k = 0; k < before_.size(); ++k) {
        if (!(after_[k].mass > 0)) bound_[k] = 1;
        if (bound_[k] != 0) continue;
        const Vec3 linear = kept * (before_[k].linear + before_[k].mass * velocity);
        const Vec3 spin = kept * before_[k].spin;
        if (dt > 0)
            way_[k] = before_[k].centre - after_[k].centre +
                      0.5 * dt / before_[k].mass * (before_[k].linear + linear);
        // The correction replaces the momenta it was made from.
        after_[k].linear = (linear - after_[k].linear) / after_[k].mass;
        after_[k].spin = angular_velocity(after_[k].inertia, spin - after_[k].spin);
    }
    for_phyxels(parallel, phyxels.size(), [&](std::size_t i) {
        const std::size_t k = slot(phyxels.piece[i]);
        if (bound_[k] != 0) return;
        const Vec3 change = after_[k].linear + after_[k].spin.cross(phyxels.position[i] - after_[k].centre);
        phyxels.velocity[i] += change;
        if (!shift.empty()) phyxels.position[i] += shift[i] * change;
        phyxels.position[i] += way_[k];
    });
}

void deform_and_flow(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                     double dt, const Parallel& parallel) {
    update_deformation(phyxels, neighbourhoods, parallel);
    if (!material.plasticity) return;
    for_phyxels(parallel, phyxels.size(), [&](std::size_t i) {
        Mat3& plastic = phyxels.plastic_strain[i];
        const Mat3 projector = neighbourhoods.kept_directions(i);
        const Mat3 seen = projector * plastic * projector;
        const Mat3 total = strain(material, phyxels.deformation[i], phyxels.rotation[i]);
        const Mat3 after = flow(*material.plasticity, projector * total * projector, seen, dt);
        plastic += after - seen;
    });
}

void describe_state(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                    ElasticForces& elastic, SolverReport& report, const Parallel& parallel) {
    report.elastic_energy = elastic.energy(neighbourhoods, material, state_of(phyxels), parallel);
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (phyxels.rigid.index(phyxels.piece[i]) >= 0) continue;
        const double speed_squared = phyxels.velocity[i].squaredNorm();
        report.inverted += !(phyxels.deformation[i].determinant() > 0);
        report.rank_deficient += neighbourhoods.rank()[i] < 3;
        report.kinetic_energy += 0.5 * phyxels.mass[i] * speed_squared;
        report.top_speed = std::max(report.top_speed, speed_squared);
    }
    for (const RigidPiece& body : phyxels.rigid.bodies) {
        report.kinetic_energy += body.kinetic_energy();
        report.top_speed = std::max(report.top_speed, body.velocity().squaredNorm());
    }
    report.top_speed = std::sqrt(report.top_speed);
    const Momenta total = total_momenta(phyxels);
    report.momentum = total.linear;
    report.angular_momentum = total.angular();
}

}  // namespace splitcubes::meshless
