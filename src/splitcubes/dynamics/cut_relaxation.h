// Relaxation of the elastic energy that a cut would add.
#pragma once

#include <splitcubes/elasticity/simd/sliced_elasticity.h>
#include <splitcubes/samples/phyxels.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Moves phyxels after a cut until each elastic piece has no more elastic energy than its phyxels had before.
///
/// A cut takes links away. Evenly strained material keeps its strain and its energy. Elsewhere the fitted
/// strain jumps, most of all where few links are left, and energy appears that nothing put in. It sits in the
/// stiffest modes of a few phyxels, which conjugate gradients reach first: a few iterations suffice.
/// Displacements are far below the spacing but for phyxels with two or three links in strongly strained
/// material. The iterations end where the energy of before is reached, so what the cut released stays
/// strained. Centres of mass and both momenta of pieces that nothing holds stay. In held pieces the potential
/// energy of gravity counts as well: where they hang at rest, their weight balances the elastic forces.
///
/// A group of phyxels that had no links to the rest of its piece may have moved away from it by any distance.
/// Before the iterations, each group that new links join to its piece again is moved as a whole to where
/// these links are strained least.
class CutRelaxation {
  public:
    struct Report {
        int iterations = 0;  // of conjugate gradients
        double gained = 0;   // J, of pieces that had gained energy
        double left = 0;     // J, of that, in the end
    };
    struct Conditions {
        std::span<const std::uint8_t> held;  // per phyxel, 1 if its position is prescribed
        /// Groups of phyxels, each ascending, that have new links to the rest of their piece.
        std::span<const std::vector<std::uint32_t>> rejoined;
        Vec3 gravity = Vec3::Zero();  // m/s^2
        int piece_count = 0;
    };
    /// Must be called after the neighbourhoods of a cut are complete. phyxels.elastic_energy holds the energy
    /// before the cut.
    Report relax(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                 const Conditions& conditions, const Parallel& parallel);

  private:
    struct Piece {
        double before = 0;       // J, elastic energy before the cut
        double energy = 0;       // J, now; with what gravity took, if it is held
        double lifted = 0;       // J, potential energy that displacements added, with this gravity
        double last_energy = 0;  // J, before the last displacement
        double tolerance = 0;    // J
        double missing = 0;      // J, what conjugate gradients have not removed yet
        double square = 0;       // N^2, of the residual
        double last_square = 0;  // N^2, in the last iteration
        double curvature = 0;    // N^3/m, direction . K direction
        double step = 0;         // m/N, along the direction
        bool is_relaxing = false;
        bool moves = false;  // was relaxing at some time
        bool is_stuck = false;
        bool is_held = false;
        Vec3 gravity = Vec3::Zero();  // m/s^2, that counts: zero unless it is held
    };

    Piece& piece_of(const Phyxels& phyxels, std::size_t i) {
        return pieces_[static_cast<std::size_t>(phyxels.piece[i])];
    }
    void begin(const Phyxels& phyxels, const Material& material, const Conditions& conditions);
    bool measure(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                 const Parallel& parallel);
    void list_moving(const Phyxels& phyxels, std::span<const std::uint8_t> held);
    int descend(const Phyxels& phyxels, const Parallel& parallel);
    bool choose_steps();
    void move(Phyxels& phyxels, std::size_t i, const Vec3& displacement);
    void displace(Phyxels& phyxels);
    void place_group(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                     std::span<const std::uint32_t> group);
    void place_rejoined(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                        const Conditions& conditions, const Parallel& parallel);
    bool take_back(Phyxels& phyxels, double share);
    void restore_momenta(Phyxels& phyxels, int piece_count) const;

    SlicedElasticity elastic_;
    std::vector<Piece> pieces_;
    std::vector<std::uint32_t> deformable_;  // phyxels of pieces that are not rigid
    std::vector<std::uint32_t> moving_;      // those that may move
    // Per phyxel.
    std::vector<double> energy_, no_diagonal_;          // J; zeros
    std::vector<Vec3> residual_, direction_, product_;  // N, N, N^2/m
    std::vector<Vec3> displacement_;                    // m
    std::vector<Momenta> before_;                       // per piece
};

}  // namespace splitcubes::meshless
