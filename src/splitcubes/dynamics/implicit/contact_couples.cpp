// Couples of contacts whose two points lie apart, taken back after ImplicitSolver's step.
#include <splitcubes/dynamics/implicit/solver_group.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

namespace splitcubes::meshless {

namespace {

/// Piece of a part and what its contacts did to it.
struct Turned {
    Vec3 impulse = Vec3::Zero();  // N m s, to be added
    Vec3 spin = Vec3::Zero();     // rad/s, that it causes
};

/// Sets of pieces that touch each other.
class TouchingSets {
  public:
    explicit TouchingSets(std::size_t pieces) : parent_(pieces), is_supported_(pieces, 0) {
        std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    }
    void join(std::size_t a, std::size_t b) {
        a = root(a), b = root(b);
        is_supported_[std::min(a, b)] |= is_supported_[std::max(a, b)];
        parent_[std::max(a, b)] = std::min(a, b);
    }
    /// Marks the set of a piece that touches a collider.
    void support(std::size_t piece) { is_supported_[root(piece)] = 1; }
    bool is_supported(std::size_t piece) { return is_supported_[root(piece)] != 0; }

  private:
    std::size_t root(std::size_t piece) {
        while (parent_[piece] != piece) piece = parent_[piece] = parent_[parent_[piece]];
        return piece;
    }
    std::vector<std::size_t> parent_;
    std::vector<std::uint8_t> is_supported_;
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
    std::vector<std::vector<Momenta>> momenta(size());
    std::vector<std::vector<Turned>> turned(size());
    each([&](ImplicitSolver&, const Job& job, std::uint32_t k) {
        momenta_of_pieces(job.phyxels, job.input.piece_count, momenta[k]);
        turned[k].resize(momenta[k].size());
    });
    const auto index_of = [&](const ContactSide& side) {
        return solvers[side.part]->piece_of(jobs[side.part], side.phyxel[0]);
    };
    std::vector<std::size_t> first(size() + 1, 0);  // slot of each part's first piece
    for (std::size_t k = 0; k < size(); ++k) first[k + 1] = first[k] + turned[k].size() + 1;
    TouchingSets sets(first.back());
    forces->each_active([&](const Contact& contact, const Vec3&, const Vec3&) {
        const std::size_t slot = first[contact.upper.part] + index_of(contact.upper);
        if (contact.lower.is_collider())
            sets.support(slot);
        else
            sets.join(slot, first[contact.lower.part] + index_of(contact.lower));
    });
    forces->each_active([&](const Contact& contact, const Vec3& apart, const Vec3& force) {
        const ContactSide &upper = contact.upper, &lower = contact.lower;
        if (contact.turn_displacement.isZero(0)) return;
        const std::size_t a = index_of(upper), b = index_of(lower);
        if (a >= turned[upper.part].size() || b >= turned[lower.part].size()) return;
        if (!sets.is_supported(first[upper.part] + a)) return;
        const double mass = momenta[upper.part][a].mass, other = momenta[lower.part][b].mass;
        const Vec3 impulse = -jobs[0].input.dt / (mass + other) * apart.cross(force);
        if (!impulse.allFinite()) return;
        turned[upper.part][a].impulse += mass * impulse;
        turned[lower.part][b].impulse += other * impulse;
    });
    // Kinetic energy that all of it takes, and that a share s of it takes: s taken - s^2 spent.
    double taken = 0, spent = 0;
    each([&](ImplicitSolver& s, const Job&, std::uint32_t k) {
        for (std::size_t p = 0; p < turned[k].size(); ++p) {
            const Momenta& piece = momenta[k][p];
            Turned& own = turned[k][p];
            if (own.impulse.isZero(0) || !std::isfinite(s.conditions_.piece_mass[p])) continue;
            own.spin = angular_velocity(piece.inertia, own.impulse);
            if (!own.spin.allFinite()) own.spin.setZero();
            taken -= own.spin.dot(piece.angular_momentum);
            spent += 0.5 * own.spin.dot(own.impulse);
        }
    });
    if (!(taken > 0) || !(spent > 0)) return;
    const double share = std::min(1.0, 0.5 * taken / spent);
    each([&](ImplicitSolver& s, const Job& job, std::uint32_t k) {
        for (std::size_t i = 0; i < job.phyxels.size(); ++i) {
            const std::size_t p = s.piece_of(job, i);
            if (p >= turned[k].size() || turned[k][p].spin.isZero(0)) continue;
            const Vec3 change =
                share * turned[k][p].spin.cross(job.phyxels.position[i] - momenta[k][p].centre);
            job.phyxels.velocity[i] += change;
            job.phyxels.previous_velocity[i] += change;
        }
    });
}

}  // namespace splitcubes::meshless
