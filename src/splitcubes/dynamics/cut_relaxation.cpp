#include <splitcubes/dynamics/cut_relaxation.h>
#include <splitcubes/dynamics/step_results.h>
#include <splitcubes/dynamics/tuning.h>
#include <splitcubes/math/decompose.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace splitcubes::meshless {

void CutRelaxation::begin(const Phyxels& phyxels, const Material& material, const Conditions& conditions) {
    const int piece_count = conditions.piece_count;
    pieces_.assign(static_cast<std::size_t>(piece_count), Piece{});
    deformable_.clear();
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const std::int32_t at = phyxels.piece[i];
        if (at < 0 || at >= piece_count || phyxels.rigid.index(at) >= 0) continue;
        deformable_.push_back(static_cast<std::uint32_t>(i));
        Piece& piece = piece_of(phyxels, i);
        piece.is_held = piece.is_held || conditions.held[i] != 0;
        piece.before += phyxels.elastic_energy[i];
        piece.tolerance += tuning::energy::noise_strain * tuning::energy::noise_strain *
                           material.youngs_modulus * phyxels.volume[i];
    }
    for (Piece& piece : pieces_) {
        piece.tolerance += tuning::relaxation::tolerance * piece.before;
        if (piece.is_held) piece.gravity = conditions.gravity;
    }
}

// Computes the energies and returns whether a piece is to be relaxed further.
bool CutRelaxation::measure(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                            const Material& material, const Parallel& parallel) {
    energy_.resize(phyxels.size());
    const SlicedElasticity::Configuration now = configuration_of(phyxels);
    elastic_.take_state_and_energy(neighbourhoods, material, now, parallel);
    elastic_.energy(now, parallel, energy_);
    for (Piece& piece : pieces_) piece.energy = piece.lifted;
    for (const std::uint32_t i : deformable_) piece_of(phyxels, i).energy += energy_[i];
    bool any = false;
    for (Piece& piece : pieces_) {
        piece.is_relaxing = piece.energy > piece.before + piece.tolerance && !piece.is_stuck;
        piece.moves = piece.moves || piece.is_relaxing;
        any = any || piece.is_relaxing;
    }
    return any;
}

void CutRelaxation::list_moving(const Phyxels& phyxels, std::span<const std::uint8_t> held) {
    moving_.clear();
    for (const std::uint32_t i : deformable_)
        if (piece_of(phyxels, i).is_relaxing && held[i] == 0) moving_.push_back(i);
}

// Chooses how far each piece goes along its direction: to the least energy, or to that of before the cut.
// Returns whether any goes on.
bool CutRelaxation::choose_steps() {
    bool any = false;
    for (Piece& piece : pieces_) {
        piece.step = 0;
        if (!(piece.missing > 0) || !(piece.square > 0) || !(piece.curvature > 0)) continue;
        const double whole = piece.square / piece.curvature, fall = 0.5 * whole * piece.square;
        if (!std::isfinite(fall)) continue;
        piece.step = fall > piece.missing ? whole * (1 - std::sqrt(1 - piece.missing / fall)) : whole;
        piece.missing -= fall;
        any = true;
    }
    return any;
}

// Minimises the energy by its tangent, by conjugate gradients for all relaxing pieces at once. Returns the
// number of iterations; the result is displacement_.
int CutRelaxation::descend(const Phyxels& phyxels, const Parallel& parallel) {
    const std::size_t n = phyxels.size();
    residual_.resize(n);
    product_.resize(n);
    no_diagonal_.assign(n, 0);
    direction_.assign(n, Vec3::Zero());
    displacement_.assign(n, Vec3::Zero());
    elastic_.forces(residual_, parallel);
    for (const std::uint32_t i : moving_) residual_[i] += phyxels.mass[i] * piece_of(phyxels, i).gravity;
    for (Piece& piece : pieces_) {
        piece.missing = piece.is_relaxing ? piece.energy - piece.before : 0;
        piece.last_square = 0;
    }
    for (int iteration = 0; iteration < tuning::relaxation::max_iterations; ++iteration) {
        for (Piece& piece : pieces_) piece.square = piece.curvature = 0;
        for (const std::uint32_t i : moving_) piece_of(phyxels, i).square += residual_[i].squaredNorm();
        for (const std::uint32_t i : moving_) {
            const Piece& piece = piece_of(phyxels, i);
            const double kept = piece.last_square > 0 ? piece.square / piece.last_square : 0;
            direction_[i] = residual_[i] + kept * direction_[i];
        }
        elastic_.apply_stiffness(1.0, no_diagonal_, direction_, product_, parallel);
        for (const std::uint32_t i : moving_)
            piece_of(phyxels, i).curvature += direction_[i].dot(product_[i]);
        if (!choose_steps()) return iteration;
        for (const std::uint32_t i : moving_) {
            const double step = piece_of(phyxels, i).step;
            displacement_[i] += step * direction_[i];
            residual_[i] -= step * product_[i];
        }
        for (Piece& piece : pieces_) piece.last_square = piece.square;
    }
    return tuning::relaxation::max_iterations;
}

// Moves a phyxel; its history, too, so that the displacement is no velocity.
void CutRelaxation::move(Phyxels& phyxels, std::size_t i, const Vec3& displacement) {
    phyxels.position[i] += displacement;
    phyxels.previous_position[i] += displacement;
    Piece& piece = piece_of(phyxels, i);
    piece.lifted -= phyxels.mass[i] * piece.gravity.dot(displacement);
}

void CutRelaxation::displace(Phyxels& phyxels) {
    for (const std::uint32_t i : moving_) move(phyxels, i, displacement_[i]);
    for (Piece& piece : pieces_) piece.last_energy = piece.energy;
}

// Takes back a share of the last displacement where the energy has risen, as it may far from the tangent.
// Returns whether there was such a piece. share: 1 gives the piece up.
bool CutRelaxation::take_back(Phyxels& phyxels, double share) {
    bool any = false;
    for (Piece& piece : pieces_) {
        piece.step = piece.is_relaxing && !(piece.energy < piece.last_energy) ? share : 0;
        piece.is_stuck = piece.is_stuck || piece.step == 1;
        any = any || piece.step > 0;
    }
    if (!any) return false;
    for (const std::uint32_t i : moving_) {
        const Vec3 back = piece_of(phyxels, i).step * displacement_[i];
        move(phyxels, i, -back);
        displacement_[i] -= back;
    }
    return true;
}

// Internal forces move no mean position, but they move the centre of mass where masses differ, and other
// positions change the angular momentum of the same velocities.
void CutRelaxation::restore_momenta(Phyxels& phyxels, int piece_count) const {
    std::vector<Momenta> after;
    momenta_of_pieces(phyxels, piece_count, after);
    std::vector<Vec3> shift(after.size()), spin(after.size());
    for (std::size_t k = 0; k < after.size(); ++k) {
        shift[k] = before_[k].centre - after[k].centre;
        spin[k] = angular_velocity(after[k].inertia, before_[k].angular_momentum - after[k].angular_momentum);
    }
    for (const std::uint32_t i : deformable_) {
        const auto k = static_cast<std::size_t>(phyxels.piece[i]);
        if (!pieces_[k].moves || pieces_[k].is_held) continue;
        const Vec3 turning = spin[k].cross(phyxels.position[i] - after[k].centre);
        phyxels.velocity[i] += turning;
        phyxels.previous_velocity[i] += turning;
        phyxels.position[i] += shift[k];
        phyxels.previous_position[i] += shift[k];
    }
}

// Moves a group rigidly to where its links to other phyxels of the piece are strained least: each end of a
// link then is where the deformation of the other end has it. Weights: those of the links.
void CutRelaxation::place_group(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                std::span<const std::uint32_t> group) {
    struct Match {
        Vec3 from, to;  // m, world
        double weight;
    };
    std::vector<Match> matches;
    double total = 0, spread = 0;  // of weights; m^2, weighted
    Vec3 from = Vec3::Zero(), to = Vec3::Zero();
    const auto match = [&](const Vec3& at, const Vec3& target, double weight) {
        matches.push_back({at, target, weight});
        total += weight;
        from += weight * at;
        to += weight * target;
    };
    for (const std::uint32_t i : group)
        for (std::uint32_t l = neighbourhoods.links_begin(i); l < neighbourhoods.links_end(i); ++l) {
            const std::uint32_t j = neighbourhoods.neighbour()[l];
            const double weight = neighbourhoods.weight()[l];
            if (!(weight > 0) || phyxels.piece[j] != phyxels.piece[i] ||
                std::binary_search(group.begin(), group.end(), j))
                continue;
            const Vec3& edge = neighbourhoods.rest_edge()[l];
            match(phyxels.position[i], phyxels.position[j] - phyxels.deformation[j] * edge, weight);
            match(phyxels.position[i] + phyxels.deformation[i] * edge, phyxels.position[j], weight);
            spread += weight * edge.squaredNorm();
        }
    if (!(total > 0)) return;
    from /= total;
    to /= total;
    // Links along one line leave a rotation open, which is then none.
    Mat3 covariance = tuning::relaxation::open_rotation * spread * Mat3::Identity();
    for (const Match& m : matches) covariance += m.weight * (m.to - to) * (m.from - from).transpose();
    const Mat3 turn = rotation_of(covariance);
    for (const std::uint32_t i : group) {
        const Vec3 displacement = to + turn * (phyxels.position[i] - from) - phyxels.position[i];
        move(phyxels, i, displacement);
        displacement_[i] += displacement;
    }
}

// Places the groups of relaxing pieces, where that lowers the energy.
void CutRelaxation::place_rejoined(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                   const Material& material, const Conditions& conditions,
                                   const Parallel& parallel) {
    displacement_.assign(phyxels.size(), Vec3::Zero());
    for (Piece& piece : pieces_) piece.last_energy = piece.energy;
    bool any = false;
    for (const std::vector<std::uint32_t>& group : conditions.rejoined) {
        const auto is_held = [&](std::uint32_t i) { return conditions.held[i] != 0; };
        const std::int32_t at = phyxels.piece[group.front()];
        if (phyxels.rigid.index(at) >= 0 || !piece_of(phyxels, group.front()).is_relaxing ||
            std::any_of(group.begin(), group.end(), is_held))
            continue;
        place_group(phyxels, neighbourhoods, group);
        any = true;
    }
    if (!any) return;
    measure(phyxels, neighbourhoods, material, parallel);
    bool is_back = false;
    for (const std::uint32_t i : deformable_) {
        const Piece& piece = piece_of(phyxels, i);
        if (piece.energy < piece.last_energy || displacement_[i].isZero(0)) continue;
        move(phyxels, i, -displacement_[i]);
        is_back = true;
    }
    if (is_back) measure(phyxels, neighbourhoods, material, parallel);
}

CutRelaxation::Report CutRelaxation::relax(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                           const Material& material, const Conditions& conditions,
                                           const Parallel& parallel) {
    Report report;
    begin(phyxels, material, conditions);
    if (!measure(phyxels, neighbourhoods, material, parallel)) return report;
    for (const Piece& piece : pieces_)
        if (piece.is_relaxing) report.gained += piece.energy - piece.before;
    momenta_of_pieces(phyxels, conditions.piece_count, before_);
    if (!conditions.rejoined.empty()) place_rejoined(phyxels, neighbourhoods, material, conditions, parallel);
    bool any = true;
    for (int round = 0; any && round < tuning::relaxation::max_rounds; ++round) {
        list_moving(phyxels, conditions.held);
        report.iterations += descend(phyxels, parallel);
        displace(phyxels);
        any = measure(phyxels, neighbourhoods, material, parallel);
        for (int k = 0; k <= tuning::relaxation::max_halvings; ++k) {
            if (!take_back(phyxels, k < tuning::relaxation::max_halvings ? 0.5 : 1)) break;
            any = measure(phyxels, neighbourhoods, material, parallel);
        }
    }
    restore_momenta(phyxels, conditions.piece_count);
    for (const Piece& piece : pieces_)
        if (piece.moves) report.left += piece.energy - piece.before;
    return report;
}

}  // namespace splitcubes::meshless
