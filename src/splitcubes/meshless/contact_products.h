// Products with the springs of contacts and pulls within conjugate gradients, and what they ask of the
// preconditioner.
#pragma once

#include <splitcubes/math/types.h>
#include <splitcubes/meshless/contact.h>
#include <splitcubes/meshless/loops.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// A list of springs between weighted means of phyxels, in single precision, as the rest of the solve is:
///
///     C = sum over springs s of  w_s (across 1 + (along - across) n n^T) w_s^T,
///
/// w_s being the weights of its sides, the lower one's negative. The list is made anew when other springs
/// push. Each spring is multiplied by itself, then each phyxel sums up its springs in the order of the list:
/// the same bits for any number of threads.
class ContactProducts {
  public:
    /// A part's row arrays: component k of phyxel i is at k * stride + i.
    struct RowPart {
        std::size_t stride = 0;
        const float* in = nullptr;
        float* out = nullptr;
    };
    /// A part's diagonals, per phyxel, m/N: the inverse of the solve's without springs, and what the rest of
    /// the preconditioner multiplies by. fixed: 1: it does not move.
    struct Diagonal {
        std::span<const double> mobility, inverse;
        std::span<const std::uint8_t> fixed;
    };

    /// Begins a list. phyxels: of each part.
    void clear(std::span<const std::size_t> phyxels);
    /// along: N/m, in the direction of the contact's normal; across: N/m, in its plane.
    void add(const Contact& contact, double along, double across);
    void add(const HandleSpring& pull, double stiffness);
    /// Changes the stiffness of a spring, by its number in order of adding.
    void set(std::size_t spring, double along, double across);
    /// Ends a list.
    void finish();
    /// Before smooth, once the list is made.
    void take_diagonals(std::span<const Diagonal> diagonals);
    bool empty() const { return springs_.empty(); }

    /// out += C in; returns in . C in.
    double apply(std::span<const RowPart> parts, const Parallel& parallel);
    /// The preconditioner of the springs' phyxels: with E the diagonal without springs, (E + C) z = r by a
    /// fixed number of steps of Chebyshev's semi-iteration (Saad 2003, algorithm 12.1) with the diagonal D of
    /// E and the sums of C's absolute values by rows. It is linear, symmetric and positive, since D
    /// bounds E + C. Finds z of the residuals `in`, less `inverse` times them, and returns its product with
    /// them.
    double smooth(std::span<const RowPart> parts, const Parallel& parallel);
    /// Adds what smooth found to `out`.
    void add_smoothed(std::span<const RowPart> parts) const;

  private:
    /// Three components and a zero, as one vector register.
    using Packed = Eigen::Vector4f;
    struct Spring {
        Packed normal = Packed::Zero();
        float across = 0, beyond = 0;  // N/m, across and along less across
        std::uint32_t first = 0;       // its phyxels: in ends_
    };
    /// A spring's hold of a phyxel.
    struct End {
        std::uint32_t at = 0;  // in touched_; of those by phyxel in springs_
        float weight = 0;      // of the lower side negative
    };
    struct Touched {
        std::uint32_t part = 0, phyxel = 0, first = 0;  // its springs: in by_phyxel_
        float own = 0;                                  // N/m, E
        float bound = 0;                                // m/N, D^-1; zero where it does not move
        float inverse = 0;                              // m/N, the rest of the preconditioner's
    };
    void hold(std::uint32_t part, std::uint32_t phyxel, double weight);
    double push(const std::vector<Packed>& ways, const Parallel& parallel);
    Packed pushed(std::size_t touched) const;
    void take_in(std::span<const RowPart> parts, std::vector<Packed>& to) const;

    std::vector<Spring> springs_;   // and one more
    std::vector<Touched> touched_;  // and one more
    std::vector<End> ends_, by_phyxel_;
    std::vector<std::vector<std::uint32_t>> slot_;  // per part, per phyxel: in touched_, from 1; 0: none
    std::vector<Packed> force_;                     // per spring
    std::vector<Packed> way_, residual_, smooth_, move_;  // per touched phyxel
    ChunkSumOf<double> sum_;
    std::size_t spring_count_ = 0, touched_count_ = 0;
};

}  // namespace splitcubes::meshless
