// Bodies that take an implicit step together. Private to ImplicitSolver.
#pragma once

#include <splitcubes/meshless/implicit_solver.h>

#include <functional>

namespace splitcubes::meshless {

/// Bodies that step together, and their contacts.
struct ImplicitSolver::Group {
    std::vector<ImplicitSolver*> solvers;
    std::vector<Job> jobs;
    ContactForces* forces = nullptr;
    std::vector<std::span<const Vec3>> base, place;
    std::vector<std::span<Vec3>> pushed, image;
    std::vector<std::span<std::uint8_t>> touching;
    std::vector<std::span<const Vec3>> velocity, solution, direction;
    std::vector<ContactForces::Part> parts;
    std::vector<ContactProducts::RowPart> rows;
    std::vector<ContactProducts::Diagonal> diagonals;
    double furthest = 0;               // square of the largest residual since it was taken from the solution
    double springs = 0;                // N/m, what springs add to the diagonals
    bool diagonals_taken = false;      // by the products, since the bodies' were found
    double weighed = -1;               // N/m, all springs that the aggregates were weighed with; -1: not yet
    std::vector<std::uint8_t> impact;  // per contact
    std::vector<std::uint8_t> pushed_before;  // per contact

    void clear() {
        solvers.clear();
        jobs.clear();
        parts.clear();
        touching.clear();
        for (auto* spans : {&base, &place, &velocity, &solution, &direction}) spans->clear();
        for (auto* spans : {&pushed, &image}) spans->clear();
    }
    std::size_t size() const { return solvers.size(); }
    void add(ImplicitSolver& solver, const Job& job) {
        solvers.push_back(&solver);
        jobs.push_back(job);
        base.emplace_back(solver.base_);
        place.emplace_back(solver.p_);
        pushed.emplace_back(solver.pushed_);
        image.emplace_back(solver.q_);
        velocity.emplace_back(job.phyxels.velocity);
        solution.emplace_back(solver.d_);
        direction.emplace_back(solver.p_);
        touching.emplace_back(job.phyxels.touching);
    }
    double tolerance_factor = 1;  // times the tolerance, of the solves to come
    template <class Do>
    void each(const Do& act) {
        for (std::size_t k = 0; k < size(); ++k) act(*solvers[k], jobs[k], static_cast<std::uint32_t>(k));
    }
    void begin_contacts(const ContactInput& input);
    void place_touched();
    void clear_contacts();
    void refresh_contacts();
    bool revise(bool only_add);
    void solve(bool anew);
    double tolerance() const;
    double loosest(double closest) const;
    double wanted_residual();
    double residual(bool exact, double& noise);
    double first_residual(double wanted);
    double carried_residual();
    double descend(double goal, int& left);
    double begin_direction();
    double apply_to_direction();
    double advance(float alpha);
    double correct();
    void weigh();
    void list_springs();
    void take_smoothing_rows();
    double smooth();
    void turn_direction(float beta);
    void solve_with_contacts();
    void break_switched(const ContactInput& contacts);
    using SetOf = std::function<std::size_t(std::uint32_t part, std::uint32_t phyxel)>;
    void restore(std::size_t set, const SetOf& set_of);
};

}  // namespace splitcubes::meshless
