// Bodies that take an implicit step together. Private to ImplicitSolver.
#pragma once

#include <splitcubes/dynamics/implicit/block_jacobi.h>
#include <splitcubes/dynamics/implicit/implicit_solver.h>
#include <splitcubes/dynamics/implicit/rigid_modes.h>

#include <functional>

namespace splitcubes::meshless {

/// Parts of the preconditioner that only slow solves need.
struct SlowSolves {
    RigidModes modes;
    BlockJacobi blocks;
    bool need_modes = false;   // a solve of this step, or of one of the last steps, was slow without them
    bool need_blocks = false;  // solves of this step were slow with modes alone
    int iterations_with_modes = 0;  // of this step, before blocks were needed

    void clear_matrices() {
        modes.clear();
        blocks.clear();
    }
    void clear_springs() {
        modes.clear_springs();
        blocks.clear_springs();
    }
    void begin_step() {
        clear_matrices();
        need_modes = need_blocks = false;
        iterations_with_modes = 0;
    }
};

/// Bodies that are solved together, and their contacts.
struct ImplicitSolver::Group {
    std::vector<ImplicitSolver*> solvers;
    std::vector<Job> jobs;
    ContactForces* forces = nullptr;
    std::vector<std::span<const Vec3>> base, position, search_start;
    std::vector<std::span<Vec3>> spring_force, matrix_product;
    std::vector<std::span<std::uint8_t>> touching;
    std::vector<std::span<const Vec3>> velocity, solution, direction;
    std::vector<ContactForces::Part> parts;
    std::vector<ContactProducts::RowPart> rows;
    std::vector<ContactProducts::Diagonal> diagonals;
    double max_square = 0;           // largest squared residual since it was last computed from the solution
    double spring_stiffness = 0;     // N/m, sum of the springs' contributions to the diagonals
    bool are_diagonals_set = false;  // set in products(), since the bodies' diagonals changed
    double weighed_stiffness = -1;   // N/m, spring_stiffness when the aggregates were weighed; -1: never
    SlowSolves slow;
    std::vector<std::uint8_t> impact;         // per contact (find_impacts)
    std::vector<std::uint8_t> pushed_before;  // per contact (find_impacts)

    void clear() {
        slow.begin_step();
        solvers.clear();
        jobs.clear();
        parts.clear();
        touching.clear();
        for (auto* spans : {&base, &position, &velocity, &solution, &direction}) spans->clear();
        for (auto* spans : {&spring_force, &matrix_product}) spans->clear();
    }
    std::size_t size() const { return solvers.size(); }
    void add(ImplicitSolver& solver, const Job& job) {
        solvers.push_back(&solver);
        jobs.push_back(job);
        base.emplace_back(solver.system_.base);
        position.emplace_back(solver.vectors_.p);
        spring_force.emplace_back(solver.springs_.force);
        matrix_product.emplace_back(solver.vectors_.q);
        velocity.emplace_back(job.phyxels.velocity);
        solution.emplace_back(solver.vectors_.d);
        direction.emplace_back(solver.vectors_.p);
        touching.emplace_back(job.phyxels.touching);
    }
    double tolerance_factor = 1;  // factor on the tolerance of the following solves
    template <class Do>
    void each(const Do& act) {
        for (std::size_t k = 0; k < size(); ++k) act(*solvers[k], jobs[k], static_cast<std::uint32_t>(k));
    }
    void recall_slow_steps();
    void count_slow_steps();
    void begin_contacts(const ContactInput& input);
    void position_touched();
    void clear_contacts();
    void refresh_contacts();
    bool revise();
    void keep_solution();
    double best_share();
    void shorten_solve();
    bool turn_solutions();
    /// Returns the slot of the first piece of each part, and the end; each part has one more for phyxels
    /// without a piece.
    std::vector<std::uint32_t> first_slots() const {
        std::vector<std::uint32_t> first(1, 0);
        for (const Job& job : jobs)
            first.push_back(first.back() + static_cast<std::uint32_t>(job.input.piece_count) + 1);
        return first;
    }
    /// Returns the slot of the piece of a phyxel.
    std::uint32_t piece_slot(std::span<const std::uint32_t> first, std::uint32_t part,
                             std::uint32_t phyxel) const {
        return first[part] + static_cast<std::uint32_t>(solvers[part]->piece_of(jobs[part], phyxel));
    }
    void relinearise();
    void solve(bool from_solution);
    double tolerance() const;
    double loose_square(double tight_square) const;
    double wanted_residual();
    double residual(bool exact, double& noise);
    double first_residual(double target_square);
    double kept_residual();
    double conjugate_gradients(double goal, int& iterations_left);
    double iterate(double goal, int& iterations_left, int limit);
    int iterations_without_modes();
    void build_modes();
    int iterations_without_blocks();
    void build_blocks();
    std::vector<RigidModes::Part> coarse_parts();
    double begin_direction();
    double apply_to_direction();
    double advance(float alpha);
    double correct();
    void reweigh_aggregates();
    void list_springs();
    void take_smoothing_rows();
    double smooth();
    void update_direction(float beta);
    void solve_with_contacts();
    void break_switched_histories(const ContactInput& contacts);
    using SetOf = std::function<std::size_t(std::uint32_t part, std::uint32_t phyxel)>;
    void restore(std::size_t set, const SetOf& set_of);
};

}  // namespace splitcubes::meshless
