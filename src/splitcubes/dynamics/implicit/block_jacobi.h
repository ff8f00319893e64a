// Exact solves of parts of a body: a part of the preconditioner for stiff bodies that are cut into pieces.
#pragma once

#include <splitcubes/contact/response/contact_products.h>
#include <splitcubes/dynamics/implicit/rigid_modes.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Block Jacobi preconditioner (Saad 2003, section 12.2): the sum of B^-1 r over blocks. A block holds the
/// rows and columns of its phyxels in the system of the step: inertia, stiffness, and the springs of contacts
/// and handles. The blocks are the aggregates of level 0 (Aggregates), bisected until they have at most
/// max_size phyxels. Blocks that are not positive definite to rounding are left out. No two blocks share a
/// phyxel, so results do not depend on the number of threads.
///
/// Nearly flat neighbourhoods in small pieces have stiffnesses that lie a million times apart; conjugate
/// gradients with a diagonal preconditioner take hundreds of iterations for a piece of twenty phyxels.
class BlockJacobi {
  public:
    static constexpr std::size_t max_size = 32;  // phyxels of a block

    /// Discards the matrices. To be called after every linearisation.
    void clear() { is_built_ = is_assembled_ = false; }
    /// Discards the springs of the matrices. To be called whenever they change.
    void clear_springs() { is_built_ = false; }
    bool is_built() const { return is_built_; }
    /// Assembles the blocks, their elastic part only after clear, and factorises those that changed. springs:
    /// of contacts and handles, or null.
    void build(std::span<const RigidModes::Part> parts, const ContactProducts* springs,
               const Parallel& parallel);

    /// Computes B^-1 r of the residuals in `in` (N); returns its product with r.
    double correct(std::span<const ContactProducts::RowPart> rows, const Parallel& parallel);
    /// Adds the result of correct to `out` (m).
    void add_correction(std::span<const ContactProducts::RowPart> rows, const Parallel& parallel) const;

  private:
    struct Member {
        std::uint32_t part = 0, phyxel = 0;
    };
    /// Part of a spring in the rows and columns of two members.
    struct SpringTerm {
        Eigen::Index row = 0, column = 0;  // row >= column
        Eigen::Matrix3f stiffness;         // N/m
    };
    struct Block {
        std::vector<Member> members;
        // Lower triangles; components of a phyxel are adjacent. elastic: N/m, without springs; factor: of the
        // matrix with springs, scaled to a diagonal of ones.
        Eigen::MatrixXf elastic, factor;
        Eigen::VectorXf scale;                            // (m/N)^1/2
        std::vector<SpringTerm> springs, factor_springs;  // present ones, those in the factors
        Eigen::VectorXf residual, solution;               // N, m
        bool is_factorised = false, is_positive = false;
    };
    /// Member of a block that a row sees.
    struct Seen {
        std::uint32_t block = 0;
        Eigen::Index row = 0;          // of the block's matrix
        Vec3 gradient = Vec3::Zero();  // 1/m
        double weight = 0;             // N/m, of its penalty
        double height = 0;             // N, weight times height above the plane of a flat phyxel (rank 2)
    };

    void find_blocks(std::span<const RigidModes::Part> parts);
    void see_row(const RigidModes::Part& part, std::uint32_t p, std::size_t i);
    void add_row(const RigidModes::Part& part, std::uint32_t p, std::size_t i);
    void add_off_plane(const RigidModes::Part& part, std::size_t i);
    void assemble(std::span<const RigidModes::Part> parts);
    void add_springs(const ContactProducts& springs);
    static bool have_springs_changed(const Block& block);
    static void factorise(Block& block);

    bool is_built_ = false;
    bool is_assembled_ = false;
    std::vector<Block> blocks_;
    std::size_t count_ = 0;                            // of blocks in use
    std::vector<std::vector<std::int32_t>> slot_;      // per part and phyxel: row of its block / 3, or -1
    std::vector<std::vector<std::int32_t>> block_of_;  // per part and phyxel, or -1
    std::vector<Seen> seen_;
};

}  // namespace splitcubes::meshless
