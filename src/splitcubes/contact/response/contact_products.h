// Matrix products with the springs of contacts and attachments within conjugate gradients, and their part of
// the preconditioner.
#pragma once

#include <splitcubes/contact/response/contact.h>
#include <splitcubes/math/types.h>
#include <splitcubes/samples/loops.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// List of springs between weighted means of phyxels, in single precision like the rest of the solve:
///
///     C = sum over springs s of  w_s (across 1 + (along - across) n n^T) w_s^T,
///
/// w_s being the weights of its sides, negative for the lower one. The list is rebuilt when the set of active
/// springs changes. First each spring computes its force, then each phyxel sums the forces of its springs in
/// list order: the same bits for any number of threads.
class ContactProducts {
  public:
    /// Row arrays of a part: component k of phyxel i is at k * stride + i.
    struct RowPart {
        std::size_t stride = 0;
        const float* in = nullptr;
        float* out = nullptr;
    };
    /// Diagonals of a part, per phyxel, m/N. mobility: inverse diagonal of the system without springs;
    /// inverse: the diagonal that the rest of the preconditioner multiplies by. fixed: 1: does not move.
    struct Diagonal {
        std::span<const double> mobility, inverse;
        std::span<const std::uint8_t> fixed;
    };

    /// Clears the list. phyxels: number of phyxels of each part.
    void clear(std::span<const std::size_t> phyxels);
    /// Adds a spring. along: N/m, in the direction of the contact's normal; across: N/m, in its tangent
    /// plane.
    void add(const Contact& contact, double along, double across);
    void add(const HandleSpring& handle_spring, double stiffness);
    /// Changes the stiffness of a spring, identified by its index in order of adding.
    void set(std::size_t spring, double along, double across);
    /// Completes the list.
    void finish();
    /// Sets the diagonals that smooth uses. Must be called after finish.
    void set_diagonals(std::span<const Diagonal> diagonals);
    bool empty() const { return springs_.empty(); }

    /// A spring and the phyxels that it acts on.
    struct SpringView {
        const ContactProducts& list;
        std::uint32_t first = 0;
        std::size_t count = 0;  // of phyxels
        Vec3 normal = Vec3::Zero();
        double across = 0, extra_along = 0;  // N/m: across; along minus across
        struct At {
            std::uint32_t part, phyxel;
            double weight;  // negative for the lower side
        };
        /// Returns the force of a unit displacement, N/m.
        Mat3 stiffness() const {
            return across * Mat3::Identity() + extra_along * normal * normal.transpose();
        }
        At incidence(std::size_t k) const {
            const Incidence& at = list.incidences_[first + k];
            const Touched& touched = list.touched_[at.index];
            return {touched.part, touched.phyxel, static_cast<double>(at.weight)};
        }
    };
    /// Calls act(SpringView) for the springs, after finish.
    template <class Act>
    void each_spring(const Act& act) const {
        for (std::size_t s = 0; s < spring_count_; ++s) {
            const Spring& spring = springs_[s];
            act(SpringView{*this, spring.first, springs_[s + 1].first - spring.first,
                           spring.normal.head<3>().cast<double>(), static_cast<double>(spring.across),
                           static_cast<double>(spring.extra_along)});
        }
    }

    /// out += C in; returns the product of in and C in.
    double apply(std::span<const RowPart> parts, const Parallel& parallel);
    /// Preconditions the phyxels that springs act on: with E the diagonal without springs, (E + C) z = r is
    /// approximated by a fixed number of Chebyshev iterations (Saad 2003, algorithm 12.1), scaled by a
    /// diagonal D made of E and the absolute row sums of C. The operator is linear, symmetric and positive
    /// definite, since D bounds E + C. Computes z - inverse * r for the residuals r in `in` and returns its
    /// product with r.
    double smooth(std::span<const RowPart> parts, const Parallel& parallel);
    /// Adds the result of smooth to `out`.
    void add_smoothed(std::span<const RowPart> parts) const;

  private:
    /// Three components and a zero, in one vector register.
    using Packed = Eigen::Vector4f;
    struct Spring {
        Packed normal = Packed::Zero();
        float across = 0, extra_along = 0;  // N/m: across; along minus across
        std::uint32_t first = 0;            // first of its phyxels in incidences_
    };
    /// Incidence of a spring and a phyxel.
    struct Incidence {
        std::uint32_t index = 0;  // index into touched_; in by_phyxel_: into springs_
        float weight = 0;         // negative for the lower side
    };
    struct Touched {
        std::uint32_t part = 0, phyxel = 0, first = 0;  // first: first of its springs in by_phyxel_
        float own_diagonal = 0;                         // N/m, entry of E
        float bound = 0;                                // m/N, entry of D^-1; zero if it does not move
        float inverse = 0;                              // m/N, diagonal of the rest of the preconditioner
    };
    void add_incidence(std::uint32_t part, std::uint32_t phyxel, double weight);
    double compute_forces(const std::vector<Packed>& displacements, const Parallel& parallel);
    Packed sum_forces(std::size_t touched) const;
    void read_rows(std::span<const RowPart> parts, std::vector<Packed>& to) const;

    std::vector<Spring> springs_;   // with a sentinel at the end
    std::vector<Touched> touched_;  // with a sentinel at the end
    std::vector<Incidence> incidences_, by_phyxel_;
    std::vector<std::vector<std::uint32_t>> slot_;  // per part, per phyxel: index into touched_ + 1; or 0
    std::vector<Packed> force_;                     // per spring
    std::vector<Packed> displacement_, residual_, smooth_, update_;  // per touched phyxel
    ChunkSumOf<double> sum_;
    std::size_t spring_count_ = 0, touched_count_ = 0;
};

}  // namespace splitcubes::meshless
