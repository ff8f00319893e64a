// Rigid motions of aggregates: a coarse space of the preconditioner for bodies that are cut into many pieces.
#pragma once

#include <splitcubes/contact/response/contact_products.h>
#include <splitcubes/dynamics/implicit/aggregates.h>
#include <splitcubes/elasticity/simd/sliced_elasticity.h>

#include <Eigen/SparseCholesky>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace splitcubes::meshless {

/// Additive two-level preconditioner D^-1 + Z E^-1 Z^T, E = Z^T A Z. The columns of Z are the three
/// translations and three rotations of each aggregate of level 0 (Aggregates) at the point of linearisation.
/// A is the system of the step: inertia, stiffness and the springs of contacts and handles. Of the stiffness,
/// E holds the rows of phyxels whose neighbours belong to several aggregates, and those with a twist or a
/// rank below 3; the others have next to no strain in a rigid motion. E is factorised by sparse Cholesky
/// factorisation, single-threaded: the same bits for any number of threads.
///
/// Conjugate gradients without it need most of their iterations for the rigid motions of pieces and flaps,
/// whose inertia is small beside the stiffness in the diagonal.
class RigidModes {
  public:
    /// One body.
    struct Part {
        const Neighbourhoods& neighbourhoods;
        const Aggregates& aggregates;
        const SlicedElasticity& elastic;
        std::span<const Vec3> rest_position;  // m
        std::span<const Vec3> position;       // m, of linearisation
        std::span<const double> inertia;      // N/m, per phyxel
        double factor = 1;                    // multiplies the stiffness
    };

    /// Discards the matrix. To be called after every linearisation.
    void clear() { is_built_ = is_assembled_ = false; }
    /// Discards the springs of the matrix. To be called whenever they change.
    void clear_springs() { is_built_ = false; }
    bool is_built() const { return is_built_; }
    /// Assembles E, its elastic part only after clear, and factorises it. Returns false if it is not positive
    /// definite to rounding; the modes must not be used then. springs: of contacts and handles, or null.
    bool build(std::span<const Part> parts, const ContactProducts* springs);

    /// Computes y = E^-1 Z^T r of the residuals in `in` (N); returns r . Z y.
    double correct(std::span<const ContactProducts::RowPart> rows, const Parallel& parallel);
    /// Adds Z y to `out` (m).
    void add_correction(std::span<const ContactProducts::RowPart> rows, const Parallel& parallel) const;

  private:
    using Block = Eigen::Matrix<double, 6, 6>;
    using Modes = Eigen::Matrix<double, 3, 6>;
    using Gradients = Eigen::Matrix<double, 9, 6>;
    /// Sums of a row over the phyxels of one aggregate.
    struct Seen {
        std::uint32_t aggregate = 0;
        Vec3 gradient = Vec3::Zero();      // 1/m, sum of g_ij
        Mat3 arm_gradient = Mat3::Zero();  // sum of (x_j - c) g_ij^T
        double weight = 0;                 // of the penalty, N/m
        Vec3 arm = Vec3::Zero();           // N, sum of weight (x_j - c)
        Mat3 arm_square = Mat3::Zero();    // N m
        // s_j is the height of j above the plane of a flat phyxel (rank 2).
        double height = 0;               // N, sum of weight s_j
        Vec3 height_arm = Vec3::Zero();  // N m, sum of weight s_j (x_j - c)
    };
    struct Entry {
        std::uint32_t column = 0;
        Block block = Block::Zero();
    };

    void find_centres(std::span<const Part> parts);
    // p: index of the part.
    bool see_row(const Part& part, std::uint32_t p, std::size_t i);
    void add_row(const Part& part, std::uint32_t p, std::size_t i);
    void add_penalty(const Part& part, std::uint32_t p, std::size_t i);
    void add_off_plane(const Part& part, std::size_t i, std::span<const Gradients> strain);
    void add_inertia(const Part& part, std::uint32_t p);
    void add_springs(const ContactProducts& springs);
    void assemble(std::span<const Part> parts);
    Block& block(std::uint32_t row, std::uint32_t column);
    void add_pair(std::uint32_t a, std::uint32_t b, const Block& sum);
    bool factorise();

    bool is_built_ = false;
    bool is_assembled_ = false;
    std::vector<std::uint32_t> first_;                             // per part, its first aggregate
    std::vector<Vec3> centre_;                                     // m, per aggregate
    std::vector<std::size_t> first_member_;                        // per aggregate and the end, into member_
    std::vector<std::pair<std::uint32_t, std::uint32_t>> member_;  // part and phyxel, by aggregate
    std::vector<std::vector<Vec3>> arm_;            // m, per part and phyxel, from its aggregate's centre
    std::vector<std::vector<std::int32_t>> index_;  // per part and phyxel, its aggregate, or -1
    // Per aggregate, blocks of columns up to its own: of E, and of E without springs.
    std::vector<std::vector<Entry>> blocks_, elastic_blocks_;
    std::vector<Seen> seen_;
    Eigen::SparseMatrix<double> matrix_;
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors_;
    Eigen::VectorXd sum_, solution_;
};

}  // namespace splitcubes::meshless
