// Couples of contacts whose two points lie apart, taken back after ImplicitSolver's step.
#include <splitcubes/core/disjoint_sets.h>
#include <splitcubes/dynamics/implicit/solver_group.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace splitcubes::meshless {

namespace {

/// Piece and what its contacts did to it.
struct Turned {
    Momenta momenta;
    Vec3 impulse = Vec3::Zero();  // N m s, to be added
    Vec3 spin = Vec3::Zero();     // rad/s, that it causes
};

}  // namespace

// The forces of a contact act on two means of phyxels. Where these lie apart by a vector r, they exert the
// couple r x f, which no motion of the contact shows once it is measured in the frame that rotates with both
// pieces (Contact::turn_displacement): its work comes from nothing. It is given back to both pieces, in the
// proportion of their masses by which that frame follows them, as far as this takes kinetic energy. Pieces
// that touch nothing but each other have their angular momentum restored as a whole; there, couples of single
// pieces would press them into each other.
void ImplicitSolver::Group::undo_couples() {
    if (!forces->any_turns()) return;
    const std::vector<std::uint32_t> first = first_slots();
    std::vector<Turned> pieces(first.back());
    std::vector<Momenta> momenta;
    each([&](ImplicitSolver&, const Job& job, std::uint32_t k) {
        momenta_of_pieces(job.phyxels, job.input.piece_count, momenta);
        for (std::size_t p = 0; p < momenta.size(); ++p) pieces[first[k] + p].momenta = momenta[p];
    });
    const auto slot_of = [&](const ContactSide& side) {
        return piece_slot(first, side.part, side.phyxel[0]);
    };
    DisjointSets sets(pieces.size());
    std::vector<std::uint8_t> is_supported(pieces.size(), 0);  // by root
    forces->each_active([&](const Contact& contact, const Vec3&, const Vec3&) {
        if (!contact.lower.is_collider()) sets.join(slot_of(contact.upper), slot_of(contact.lower));
    });
    forces->each_active([&](const Contact& contact, const Vec3&, const Vec3&) {
        if (contact.lower.is_collider()) is_supported[sets.find(slot_of(contact.upper))] = 1;
    });
    forces->each_active([&](const Contact& contact, const Vec3& apart, const Vec3& force) {
        if (contact.turn_displacement.isZero(0)) return;
        const std::uint32_t slot = slot_of(contact.upper);
        Turned &upper = pieces[slot], &lower = pieces[slot_of(contact.lower)];
        const double mass = upper.momenta.mass, other = lower.momenta.mass;
        if (!(mass > 0 && other > 0) || is_supported[sets.find(slot)] == 0) return;
        const Vec3 impulse = -jobs[0].input.dt / (mass + other) * apart.cross(force);
        if (!impulse.allFinite()) return;
        upper.impulse += mass * impulse;
        lower.impulse += other * impulse;
    });
    // Kinetic energy that all of it takes, and that a share s of it takes: s taken - s^2 spent.
    double taken = 0, spent = 0;
    each([&](ImplicitSolver& s, const Job&, std::uint32_t k) {
        for (std::uint32_t slot = first[k]; slot < first[k + 1]; ++slot) {
            Turned& own = pieces[slot];
            if (own.impulse.isZero(0) || !std::isfinite(s.conditions_.piece_mass[slot - first[k]])) continue;
            own.spin = angular_velocity(own.momenta.inertia, own.impulse);
            if (!own.spin.allFinite()) own.spin.setZero();
            taken -= own.spin.dot(own.momenta.angular_momentum);
            spent += 0.5 * own.spin.dot(own.impulse);
        }
    });
    if (!(taken > 0) || !(spent > 0)) return;
    const double share = std::min(1.0, 0.5 * taken / spent);
    each([&](ImplicitSolver&, const Job& job, std::uint32_t k) {
        for (std::uint32_t i = 0; i < job.phyxels.size(); ++i) {
            const Turned& own = pieces[piece_slot(first, k, i)];
            if (own.spin.isZero(0)) continue;
            const Vec3 change = share * own.spin.cross(job.phyxels.position[i] - own.momenta.centre);
            job.phyxels.velocity[i] += change;
            job.phyxels.previous_velocity[i] += change;
        }
    });
}

}  // namespace splitcubes::meshless
